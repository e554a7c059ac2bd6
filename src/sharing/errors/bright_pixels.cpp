#include "sharing/errors/bright_pixels.h"

#include "core/util/parallel.h"

#include <algorithm>

namespace strobe {

namespace {

constexpr int kBlock = 4; ///< pixels per edge of the blocks of aroundBlocks

/// Returns the squared means of the roots of the brightness around blocks of pixels, in all lanes. Roots, so
/// that a lamp does not raise the mean around it much.
LanePlane aroundBlocks(std::span<const Brightness> brightness, int width, int height) {
    constexpr float kWindow = 2.5f; // standard deviation in blocks
    LanePlane blocks((width + kBlock - 1) / kBlock, (height + kBlock - 1) / kBlock);
    parallelFor(size_t(blocks.height), [&](size_t row) {
        const int y0 = kBlock * int(row), y1 = std::min(y0 + kBlock, height);
        for (int block = 0; block < blocks.width; ++block) {
            const int x0 = kBlock * block, x1 = std::min(x0 + kBlock, width);
            float roots = 0;
            for (int y = y0; y < y1; ++y)
                for (int x = x0; x < x1; ++x)
                    roots += std::sqrt(brightness[size_t(y) * size_t(width) + size_t(x)].mean);
            storeFloat4(blocks.row(int(row)) + LanePlane::kLanes * block,
                        Float4{} + roots / float((y1 - y0) * (x1 - x0)));
        }
    });
    LanePlane scratch(blocks.width, blocks.height);
    WindowMean(blocks.width, blocks.height, kWindow).apply(blocks, scratch);
    parallelForRuns(blocks.values.size(), [&](size_t i) { blocks.values[i] = sqr(blocks.values[i]); });
    return blocks;
}

} // namespace

BrightPixels::BrightPixels(std::span<const Brightness> brightness, int width, int height)
    : m_others(brightness.size(), 1.f) {
    // 1.4 also takes the flanks of highlights for bright, 4 leaves halos (measured).
    constexpr float kMuch = 2, kLeastWeight = 1e-12f;
    const LanePlane blocks = aroundBlocks(brightness, width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const size_t pixel = size_t(y) * size_t(width) + size_t(x);
            const float usual = kMuch * blocks.row(y / kBlock)[LanePlane::kLanes * (x / kBlock)];
            const float least = brightness[pixel].least;
            if (least > usual) {
                m_pixels.push_back({uint32_t(pixel), std::max(sqr(sqr(usual / least)), kLeastWeight)});
                m_others[pixel] = 0;
            }
        }
}

BrightMeans::BrightMeans(const LanePlane& plane, const WindowMean& window, const BrightPixels& bright)
    : m_bright(bright), m_means(bright.all().size()) {
    parallelForRuns(m_means.size(),
                    [&](size_t k) { m_means[k] = meansAround(plane, window, bright.all()[k].index); });
}

BrightMeans::Means BrightMeans::meansAround(const LanePlane& plane, const WindowMean& window,
                                            size_t pixel) const {
    const int px = int(pixel) % plane.width, py = int(pixel) / plane.width, reach = window.reach();
    const int x0 = std::max(px - reach, 0), x1 = std::min(px + reach, plane.width - 1);
    Means sums = {};
    float weightOfAll = 0, weightOfOthers = 0;
    for (int y = std::max(py - reach, 0); y <= std::min(py + reach, plane.height - 1); ++y) {
        const float* const isOther = m_bright.others().data() + size_t(y) * size_t(plane.width);
        const float ofRow = window.weight(y - py);
        for (int x = x0; x <= x1; ++x) {
            const float weight = ofRow * window.weight(x - px), ofOther = weight * isOther[x];
            const Float4 values = loadFloat4(plane.row(y) + LanePlane::kLanes * x);
            sums.all += weight * values;
            sums.others += ofOther * values;
            weightOfAll += weight;
            weightOfOthers += ofOther;
        }
    }
    const Float4 all = sums.all * (1 / weightOfAll);
    return {all, weightOfOthers > 0 ? sums.others * (1 / weightOfOthers) : all};
}

void BrightMeans::fade(LanePlane& plane) const {
    for (size_t k = 0; k < m_means.size(); ++k) {
        const BrightPixels::Pixel& pixel = m_bright.all()[k];
        float* const lanes = plane.at(pixel.index);
        const Float4 &others = m_means[k].others, values = loadFloat4(lanes);
        storeFloat4(lanes, others + pixel.weight * (values - others));
    }
}

void BrightMeans::write(LanePlane& plane) const {
    for (size_t k = 0; k < m_means.size(); ++k)
        storeFloat4(plane.at(m_bright.all()[k].index), m_means[k].all);
}

} // namespace strobe
