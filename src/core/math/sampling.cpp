#include "core/math/sampling.h"

#include <cassert>

namespace strobe {

namespace {

/// Returns the index of the cell of x in [0,1) among n cells of equal size; `fraction` receives the position
/// within the cell.
uint32_t findCell(float x, uint32_t n, float& fraction) {
    const float scaled = std::max(x, 0.f) * float(n);
    const uint32_t i = std::min(static_cast<uint32_t>(scaled), n - 1);
    fraction = scaled - float(i);
    return i;
}

/// Writes n+1 cumulated values from 0 to 1 to `cdf` and returns the sum of `values`. A sum of zero gives the
/// cdf of the uniform density.
double cumulate(const float* values, uint32_t n, float* cdf) {
    double sum = 0;
    for (uint32_t i = 0; i < n; ++i)
        sum += values[i];
    double run = 0;
    for (uint32_t i = 0; i < n; ++i) {
        cdf[i] = static_cast<float>(sum > 0 ? run / sum : double(i) / n);
        run += values[i];
    }
    cdf[n] = 1;
    return sum;
}

/// Returns the position of u within the interval [low, high), in [0,1); 0 if the interval is empty.
float fractionOf(float u, float low, float high) {
    return high > low ? std::clamp((u - low) / (high - low), 0.f, kOneMinusEpsilon) : 0;
}

float clampToUnit(float x) { return std::clamp(x, 0.f, kOneMinusEpsilon); }

} // namespace

V2f concentricDiskInverse(const V2f& p) {
    const bool isWide = std::abs(p.x) > std::abs(p.y);
    const float length = std::sqrt(p.x * p.x + p.y * p.y);
    const float major = isWide ? p.x : p.y;
    const float minor = isWide ? p.y : p.x;
    const float r = std::copysign(length, major);
    const float q = major != 0 ? r * std::atan(minor / major) * (4 / kPi) : 0;
    const V2f ab = isWide ? V2f(r, q) : V2f(q, r);
    return {clampToUnit((ab.x + 1) / 2), clampToUnit((ab.y + 1) / 2)};
}

V2f uniformConeInverse(const V3f& w, float oneMinusCosMax) {
    // Computes x = 1 - cosθ from sin²θ = x(2 - x) near the axis, where w.z lacks precision, and from w.z
    // elsewhere.
    const float sin2 = w.x * w.x + w.y * w.y;
    const float x = w.z > .7f ? oneMinusCos(std::min(sin2, 1.f)) : 1 - w.z;
    const float scale = safeSqrt(oneMinusCosMax * (2 - x));
    return concentricDiskInverse(scale > 0 ? V2f(w.x / scale, w.y / scale) : V2f(1, 0));
}

V2f uniformTriangleInverse(const V2f& b) {
    return b.x > b.y ? V2f(clampToUnit(b.x + b.y), clampToUnit(2 * b.y))
                     : V2f(clampToUnit(2 * b.x), clampToUnit(b.x + b.y));
}

float tent(float u) { return u < .5f ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 * (1 - u)); }

float tentInverse(float x) { return clampToUnit(x < 0 ? sqr(1 + x) / 2 : 1 - sqr(1 - x) / 2); }

float linearInverse(float x, float a, float b) { return clampToUnit(x * (a * (2 - x) + b * x) / (a + b)); }

V2f Bilinear::inverse(const V2f& p) const {
    return {linearInverse(p.x, lerp(f00, f01, p.y), lerp(f10, f11, p.y)),
            linearInverse(p.y, f00 + f10, f01 + f11)};
}

uint32_t findInterval(const float* cdf, uint32_t n, float u) {
    // Counts the inner boundaries that are <= u, by bisection without unpredictable branches.
    const float* inner = cdf + 1;
    uint32_t first = 0, size = n - 1;
    while (size > 0) {
        const uint32_t half = (size + 1) / 2;
        first = inner[first + half - 1] <= u ? first + half : first;
        size -= half;
    }
    while (first > 0 && cdf[first] >= cdf[n]) // u at or beyond the end: step back over empty intervals
        --first;
    return first;
}

void makeGuide(const float* cdf, uint32_t n, uint32_t* guide) {
    for (uint32_t g = 0, i = 0; g < n; ++g) {
        while (i + 1 < n && cdf[i + 1] <= float(g) / float(n))
            ++i;
        guide[g] = i;
    }
}

Piecewise1D::Piecewise1D(const std::vector<float>& values)
    : m_values(values), m_cdf(values.size() + 1), m_guide(values.size()) {
    assert(!values.empty());
    const double sum = cumulate(values.data(), count(), m_cdf.data());
    makeGuide(m_cdf.data(), count(), m_guide.data());
    m_integral = static_cast<float>(sum / count());
    for (float& v : m_values)
        v = sum > 0 ? static_cast<float>(v * (count() / sum)) : 1;
}

uint32_t Piecewise1D::sampleIndex(float u, float* remapped) const {
    const uint32_t i = findGuided(m_cdf.data(), m_guide.data(), count(), u);
    if (remapped)
        *remapped = fractionOf(u, m_cdf[i], m_cdf[i + 1]);
    return i;
}

float Piecewise1D::sample(float u) const {
    float fraction;
    const uint32_t i = sampleIndex(u, &fraction);
    return std::min((float(i) + fraction) / float(count()), kOneMinusEpsilon);
}

float Piecewise1D::pdf(float x) const {
    float fraction;
    return m_values[findCell(x, count(), fraction)];
}

float Piecewise1D::inverse(float x) const {
    float fraction;
    const uint32_t i = findCell(x, count(), fraction);
    return clampToUnit(lerp(m_cdf[i], m_cdf[i + 1], fraction));
}

Piecewise2D::Piecewise2D(const std::vector<float>& values, uint32_t nx, uint32_t ny)
    : m_nx(nx), m_cdf(size_t(nx + 1) * ny), m_guide(size_t(nx) * ny), m_values(values) {
    assert(values.size() == size_t(nx) * ny && nx > 0 && ny > 0);
    std::vector<float> rowMeans(ny);
    for (uint32_t y = 0; y < ny; ++y) {
        float* cdf = &m_cdf[size_t(y) * (nx + 1)];
        rowMeans[y] = static_cast<float>(cumulate(&values[size_t(y) * nx], nx, cdf) / nx);
        makeGuide(cdf, nx, &m_guide[size_t(y) * nx]);
    }
    m_rows = Piecewise1D(rowMeans);
    const float mean = m_rows.integral();
    for (float& v : m_values)
        v = mean > 0 ? v / mean : 1;
}

Piecewise2D::CellSample Piecewise2D::sampleColumn(uint32_t y, float offsetY, float u) const {
    const float* cdf = cdfRow(y);
    const uint32_t x = findGuided(cdf, &m_guide[size_t(y) * m_nx], m_nx, u);
    return {x, y, {fractionOf(u, cdf[x], cdf[x + 1]), offsetY}};
}

Piecewise2D::CellSample Piecewise2D::sampleCell(const V2f& u) const {
    float offsetY;
    const uint32_t y = m_rows.sampleIndex(u.y, &offsetY);
    return sampleColumn(y, offsetY, u.x);
}

void Piecewise2D::sampleCellSoA(const V2SoA& u, int n, CellSample* out) const {
    for (int i = 0; i < n; ++i) {
        CellSample& cell = out[i];
        cell.y = m_rows.sampleIndex(u.y[i], &cell.offset.y);
        cell.x = std::min(uint32_t(u.x[i] * float(m_nx)), m_nx - 1);
        __builtin_prefetch(&m_guide[size_t(cell.y) * m_nx + cell.x]);
    }
    for (int i = 0; i < n; ++i)
        __builtin_prefetch(cdfRow(out[i].y) + m_guide[size_t(out[i].y) * m_nx + out[i].x]);
    for (int i = 0; i < n; ++i)
        out[i] = sampleColumn(out[i].y, out[i].offset.y, u.x[i]);
}

V2f Piecewise2D::sample(const V2f& u) const {
    const CellSample cell = sampleCell(u);
    return {std::min((float(cell.x) + cell.offset.x) / float(m_nx), kOneMinusEpsilon),
            std::min((float(cell.y) + cell.offset.y) / float(ny()), kOneMinusEpsilon)};
}

float Piecewise2D::pdf(const V2f& p) const {
    float fraction;
    const uint32_t x = findCell(p.x, m_nx, fraction), y = findCell(p.y, ny(), fraction);
    return m_values[size_t(y) * m_nx + x];
}

V2f Piecewise2D::inverse(const V2f& p) const {
    float fx, fy;
    const uint32_t x = findCell(p.x, m_nx, fx), y = findCell(p.y, ny(), fy);
    return {clampToUnit(lerp(cdfRow(y)[x], cdfRow(y)[x + 1], fx)), m_rows.inverse(p.y)};
}

PiecewiseLinear1D::PiecewiseLinear1D(const std::vector<float>& nodes) : m_nodes(nodes), m_cdf(nodes.size()) {
    assert(nodes.size() >= 2);
    const size_t n = nodes.size() - 1;
    double sum = 0;
    for (size_t i = 0; i < n; ++i)
        sum += (double(nodes[i]) + nodes[i + 1]) / 2;
    double run = 0;
    for (size_t i = 0; i < n; ++i) {
        m_cdf[i] = static_cast<float>(run / sum);
        run += (double(nodes[i]) + nodes[i + 1]) / 2;
    }
    m_cdf[n] = 1;
    m_integral = static_cast<float>(sum / double(n));
    for (float& v : m_nodes)
        v = static_cast<float>(v * (double(n) / sum));
    m_guide.resize(n + 1);
    for (size_t g = 0; g <= n; ++g)
        m_guide[g] = findInterval(m_cdf.data(), static_cast<uint32_t>(n), float(g) / float(n));
}

float PiecewiseLinear1D::sample(float u) const {
    const uint32_t n = static_cast<uint32_t>(m_nodes.size() - 1);
    const uint32_t g = std::min(static_cast<uint32_t>(u * float(n)), n - 1);
    uint32_t i = m_guide[g];
    while (i < m_guide[g + 1] && m_cdf[i + 1] <= u)
        ++i;
    const float fraction = sampleLinear(fractionOf(u, m_cdf[i], m_cdf[i + 1]), m_nodes[i], m_nodes[i + 1]);
    return std::min((float(i) + fraction) / float(n), kOneMinusEpsilon);
}

float PiecewiseLinear1D::pdf(float x) const {
    float fraction;
    const uint32_t i = findCell(x, static_cast<uint32_t>(m_nodes.size() - 1), fraction);
    return lerp(m_nodes[i], m_nodes[i + 1], fraction);
}

float PiecewiseLinear1D::inverse(float x) const {
    float fraction;
    const uint32_t i = findCell(x, static_cast<uint32_t>(m_nodes.size() - 1), fraction);
    if (m_nodes[i] + m_nodes[i + 1] <= 0)
        return clampToUnit(m_cdf[i]);
    return clampToUnit(lerp(m_cdf[i], m_cdf[i + 1], linearInverse(fraction, m_nodes[i], m_nodes[i + 1])));
}

} // namespace strobe
