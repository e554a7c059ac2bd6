#include "sharing/rest_noise.h"

#include "core/util/parallel.h"
#include "sharing/errors/window_mean.h"

#include <algorithm>

namespace strobe {

namespace {

/// The standard deviation of the window in pixels. This noise is that of edges, which are narrow.
constexpr float kWindow = 1;

float meanOf(const Rgb& color) { return (color.x + color.y + color.z) / 3; }

/// The items of a list by ascending pixel that belong to a pixel. Pixels are asked for in ascending order.
template <class Item>
class ItemsOfPixels {
  public:
    ItemsOfPixels(std::span<const Item> items, size_t firstPixel)
        : m_items(items),
          m_next(size_t(std::lower_bound(items.begin(), items.end(), firstPixel,
                                         [](const Item& item, size_t pixel) { return item.pixel < pixel; }) -
                        items.begin())) {}
    std::span<const Item> of(size_t pixel) {
        const size_t first = m_next;
        while (m_next < m_items.size() && m_items[m_next].pixel == pixel)
            ++m_next;
        return m_items.subspan(first, m_next - first);
    }

  private:
    const std::span<const Item> m_items;
    size_t m_next;
};

/// The difference between the means of both halves of a pixel's samples.
class HalvesOfPixel {
  public:
    HalvesOfPixel(const RecordedLight& light, size_t pixel)
        : m_light(light),
          m_pixel(pixel), m_weights{float(light.weights(pixel, 0).all), float(light.weights(pixel, 1).all)} {}
    bool haveSamples() const { return m_weights[0] > 0 && m_weights[1] > 0; }
    /// Returns the factor from a squared difference to the variance of the mean of both halves.
    float scale() const { return m_weights[0] * m_weights[1] / sqr(m_weights[0] + m_weights[1]); }
    float radiance() const {
        return m_light.radiance(m_pixel, 0) / m_weights[0] - m_light.radiance(m_pixel, 1) / m_weights[1];
    }
    float part(LightPart part) const {
        return difference(m_light.light(part, m_pixel, 0).light, m_light.light(part, m_pixel, 1).light);
    }
    float rare(std::span<const PixelRareSample> samples) const {
        Rgb sums[kHalves] = {Rgb(0), Rgb(0)};
        for (const PixelRareSample& sample : samples)
            sums[sample.half] += sample.albedo * sample.light;
        return difference(sums[0], sums[1]);
    }
    float emission() const {
        const auto emission = m_light.emissionOf(m_pixel, m_pixel + 1);
        return emission.empty()
                   ? 0
                   : difference(emission.front().halves[0].emitted, emission.front().halves[1].emitted);
    }

  private:
    float difference(const Rgb& first, const Rgb& second) const {
        return meanOf(first) / m_weights[0] - meanOf(second) / m_weights[1];
    }

    const RecordedLight& m_light;
    const size_t m_pixel;
    const float m_weights[kHalves];
};

float restOfPixel(const RecordedLight& light, size_t pixel, std::span<const PixelRareSample> rare,
                  std::span<const PixelCorrection> corrections) {
    const HalvesOfPixel halves(light, pixel);
    if (!halves.haveSamples())
        return 0;
    float rest = halves.radiance();
    if (!rare.empty())
        rest -= halves.rare(rare);
    for (const PixelCorrection& correction : corrections)
        rest -= correction.replaced * halves.emission();
    for (const LightPart part : kAllParts)
        if (light.parts.has(part))
            rest -= halves.part(part);
    return halves.scale() * sqr(rest);
}

} // namespace

HugeVector<float> restVariance(const RecordedLight& light, std::span<const PixelCorrection> corrections) {
    const int width = light.pixelBounds.width(), height = light.pixelBounds.height();
    LanePlane plane(width, height), scratch(width, height);
    parallelFor(size_t(height), [&](size_t y) {
        const size_t begin = y * size_t(width), end = begin + size_t(width);
        ItemsOfPixels<PixelRareSample> rare(light.rare, begin);
        ItemsOfPixels<PixelCorrection> corrected(corrections, begin);
        for (size_t i = begin; i < end; ++i)
            storeFloat4(plane.at(i), Float4{restOfPixel(light, i, rare.of(i), corrected.of(i))});
    });
    WindowMean(width, height, kWindow).apply(plane, scratch);
    HugeVector<float> out(light.pixelCount());
    for (size_t i = 0; i < out.size(); ++i)
        out[i] = plane.at(i)[0];
    return out;
}

} // namespace strobe
