#include "lights/environment_map.h"

namespace strobe {

namespace {

V2f toMap(const V3f& w) {
    const float phi = std::atan2(w.y, w.x);
    const float u = (phi < 0 ? phi + 2 * kPi : phi) * (kInvPi / 2);
    // atan2 tells directions near the poles apart, where acos does not.
    return {std::min(u, kOneMinusEpsilon), std::atan2(std::sqrt(w.x * w.x + w.y * w.y), w.z) * kInvPi};
}

} // namespace

EnvironmentMap::EnvironmentMap(Image image) : m_image(std::move(image)) {
    const int nx = m_image.width, ny = m_image.height + 1;
    std::vector<float> flux(size_t(nx) * size_t(ny));
    double sum[3] = {0, 0, 0};
    for (int y = 0; y < ny; ++y) {
        const double scale = kPi / m_image.height;
        // The cell's height in pixels, by the mean of sinθ over it, as the difference of two cosines.
        const double share = (std::cos(top(y) * scale) - std::cos(bottom(y) * scale)) / scale;
        for (int x = 0; x < nx; ++x) {
            const Cell cell{x, y, {.5f, .5f}};
            const Rgb middle = lookup(cell);
            flux[size_t(y) * size_t(nx) + size_t(x)] = float(luminances(cell).mean() * share);
            for (int c = 0; c < 3; ++c)
                sum[c] += middle[c] * share;
        }
    }
    const double norm = kPi / 2 / (double(nx) * m_image.height);
    m_mean = Rgb(float(sum[0] * norm), float(sum[1] * norm), float(sum[2] * norm));
    m_cells = Piecewise2D(flux, uint32_t(nx), uint32_t(ny));
}

EnvironmentMap::Cell EnvironmentMap::cellAt(float u, float v) const {
    const float px = u * float(m_image.width) + .5f, py = std::clamp(v, 0.f, 1.f) * float(m_image.height);
    const int x = int(px), y = std::min(int(py + .5f), m_image.height);
    return {x % m_image.width, y, {px - float(x), (py - top(y)) / (bottom(y) - top(y))}};
}

const Rgb& EnvironmentMap::pixel(int x, int y) const {
    return m_image.at((x + m_image.width) % m_image.width, std::clamp(y, 0, m_image.height - 1));
}

Rgb EnvironmentMap::lookup(const Cell& c) const {
    const Rgb upper = pixel(c.x - 1, c.y - 1) * (1 - c.at.x) + pixel(c.x, c.y - 1) * c.at.x;
    const Rgb lower = pixel(c.x - 1, c.y) * (1 - c.at.x) + pixel(c.x, c.y) * c.at.x;
    return upper * (1 - c.at.y) + lower * c.at.y;
}

Bilinear EnvironmentMap::luminances(const Cell& c) const {
    return {luminance(pixel(c.x - 1, c.y - 1)), luminance(pixel(c.x, c.y - 1)),
            luminance(pixel(c.x - 1, c.y)), luminance(pixel(c.x, c.y))};
}

Rgb EnvironmentMap::radiance(const V3f& w) const {
    const V2f uv = toMap(w);
    return lookup(cellAt(uv.x, uv.y));
}

float EnvironmentMap::pdf(const Cell& cell, float sinTheta) const {
    const Bilinear corners = luminances(cell);
    const float mean = corners.mean();
    if (!(sinTheta > 0) || (mean <= 0 && m_cells.integral() > 0))
        return 0;
    const V2f middle((float(cell.x) + .5f) / float(m_cells.nx()),
                     (float(cell.y) + .5f) / float(m_cells.ny()));
    // Cells are equal on the unit square, but rows of the image are `height`, and the outer ones are halved.
    const float stretch = float(m_image.height) / (float(m_cells.ny()) * (bottom(cell.y) - top(cell.y)));
    const float inCell = mean > 0 ? corners.pdf(cell.at) : 1;
    return m_cells.pdf(middle) * stretch * inCell / (2 * kPi * kPi * sinTheta);
}

float EnvironmentMap::pdf(const V3f& w) const {
    const V2f uv = toMap(w);
    return pdf(cellAt(uv.x, uv.y), std::sqrt(w.x * w.x + w.y * w.y));
}

EnvironmentMap::Sample EnvironmentMap::sample(const V2f& u) const {
    const V2f s = m_cells.sample(u);
    const float sx = s.x * float(m_cells.nx()), sy = s.y * float(m_cells.ny());
    Cell cell{std::min(int(sx), m_image.width - 1), std::min(int(sy), m_image.height), {}};
    cell.at = {std::min(sx - float(cell.x), kOneMinusEpsilon),
               std::min(sy - float(cell.y), kOneMinusEpsilon)};
    const Bilinear corners = luminances(cell);
    if (corners.mean() > 0)
        cell.at = corners.sample(cell.at);
    const float px = float(cell.x) - .5f + cell.at.x, py = lerp(top(cell.y), bottom(cell.y), cell.at.y);
    const float phi = px / float(m_image.width) * 2 * kPi, theta = py / float(m_image.height) * kPi;
    const float sinTheta = std::sin(theta);
    const V3f w(sinTheta * std::cos(phi), sinTheta * std::sin(phi), std::cos(theta));
    return {w, lookup(cell), pdf(cell, sinTheta)};
}

} // namespace strobe
