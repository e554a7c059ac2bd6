#include "sharing/errors/window_mean.h"

#include "core/math/soa.h"
#include "core/util/parallel.h"

#include <algorithm>

namespace strobe {

namespace {

STROBE_TARGET_CLONES void scale(const float* in, float factor, float* out, int n) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        out[i] = factor * in[i];
}

STROBE_TARGET_CLONES void addScaled(const float* a, const float* b, float factor, float* out, int n) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        out[i] += factor * (a[i] + b[i]);
}

STROBE_TARGET_CLONES void multiply(const float* factors, float factor, float* out, int n) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        out[i] *= factors[i] * factor;
}

std::vector<float> gaussian(float sigma) {
    std::vector<float> out(size_t(std::ceil(3 * sigma)) + 1);
    for (size_t d = 0; d < out.size(); ++d)
        out[d] = std::exp(-sqr(float(d)) / (2 * sqr(sigma)));
    return out;
}

/// The position of a pixel between the centers of two blocks.
struct BlockPosition {
    int first, second;
    float fraction; ///< towards `second`

    BlockPosition(int pixel, int edge, int count) {
        const float position = std::clamp((float(pixel) + 0.5f) / float(edge) - 0.5f, 0.f, float(count - 1));
        first = int(position);
        second = std::min(first + 1, count - 1);
        fraction = position - float(first);
    }
};

} // namespace

Float4 interpolateBlocks(const LanePlane& blocks, int x, int y, int edge) {
    const BlockPosition u(x, edge, blocks.width), v(y, edge, blocks.height);
    const auto inRow = [&](int row) {
        const float* const values = blocks.row(row);
        const Float4 first = loadFloat4(values + LanePlane::kLanes * u.first),
                     second = loadFloat4(values + LanePlane::kLanes * u.second);
        return first + u.fraction * (second - first);
    };
    const Float4 above = inRow(v.first), below = inRow(v.second);
    return above + v.fraction * (below - above);
}

WindowMean::WindowMean(int width, int height, float sigma)
    : m_kernel(gaussian(sigma)), m_inverseY(inverseWeights(height)) {
    for (const float inverse : inverseWeights(width))
        m_inverseX.insert(m_inverseX.end(), LanePlane::kLanes, inverse);
}

void WindowMean::apply(LanePlane& plane, LanePlane& scratch) const {
    parallelFor(size_t(plane.height),
                [&](size_t y) { averageRow(plane.row(int(y)), plane.rowSize(), scratch.row(int(y))); });
    parallelFor(size_t(plane.height), [&](size_t y) { averageColumns(scratch, int(y), plane.row(int(y))); });
}

/// Writes the weighted sums along a row.
void WindowMean::averageRow(const float* in, int size, float* out) const {
    const int margin = LanePlane::kLanes * reach();
    std::vector<float> padded(size_t(size + 2 * margin));
    float* center = padded.data() + margin;
    std::copy(in, in + size, center);
    scale(center, m_kernel[0], out, size);
    for (int d = 1; d <= reach(); ++d)
        addScaled(center - LanePlane::kLanes * d, center + LanePlane::kLanes * d, m_kernel[size_t(d)], out,
                  size);
}

/// Writes the means of a row from the sums of the rows around it.
void WindowMean::averageColumns(const LanePlane& rows, int y, float* out) const {
    const int size = rows.rowSize();
    const std::vector<float> zeros(size_t(size), 0.f);
    const auto row = [&](int v) { return v >= 0 && v < rows.height ? rows.row(v) : zeros.data(); };
    scale(row(y), m_kernel[0], out, size);
    for (int d = 1; d <= reach(); ++d)
        addScaled(row(y - d), row(y + d), m_kernel[size_t(d)], out, size);
    multiply(m_inverseX.data(), m_inverseY[size_t(y)], out, size);
}

/// Returns the inverse of the sum of the kernel's weights around each of `length` positions.
std::vector<float> WindowMean::inverseWeights(int length) const {
    std::vector<float> out(size_t(length), 0.f);
    for (int i = 0; i < length; ++i) {
        float weight = 0;
        for (int j = std::max(0, i - reach()); j <= std::min(length - 1, i + reach()); ++j)
            weight += m_kernel[size_t(std::abs(i - j))];
        out[size_t(i)] = 1 / weight;
    }
    return out;
}

} // namespace strobe
