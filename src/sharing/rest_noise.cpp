#include "sharing/rest_noise.h"

#include "core/util/parallel.h"
#include "sharing/errors/window_mean.h"

#include <algorithm>

namespace strobe {

namespace {

/// The standard deviation, in pixels, of the window over which the variance of parts is averaged.
constexpr float kWindow = 1;

float meanOf(const Rgb& color) { return (color.x + color.y + color.z) / 3; }

/// The items of a list by ascending pixel that belong to a pixel. Pixels are asked for in ascending order.
template <class Item>
class ItemsOfPixels {
  public:
    explicit ItemsOfPixels(std::span<const Item> items, size_t firstPixel = 0)
        : m_items(items),
          m_next(size_t(std::lower_bound(items.begin(), items.end(), firstPixel, precedes) - items.begin())) {
    }
    std::span<const Item> of(size_t pixel) {
        while (m_next < m_items.size() && m_items[m_next].pixel < pixel)
            ++m_next;
        const size_t first = m_next;
        while (m_next < m_items.size() && m_items[m_next].pixel == pixel)
            ++m_next;
        return m_items.subspan(first, m_next - first);
    }

  private:
    static bool precedes(const Item& item, size_t pixel) { return item.pixel < pixel; }

    const std::span<const Item> m_items;
    size_t m_next;
};

/// The sums of the filter weights of both halves of a pixel.
struct Weights {
    Weights(const RecordedLight& light, size_t pixel)
        : first(float(light.weights(pixel, 0).all)), second(float(light.weights(pixel, 1).all)) {}
    bool haveBoth() const { return first > 0 && second > 0; }
    float all() const { return first + second; }
    /// Returns the variance of the mean of both halves that the sums of a quantity show.
    float varianceOfMean(float sumOfFirst, float sumOfSecond) const {
        return first * second / sqr(all()) * sqr(sumOfFirst / first - sumOfSecond / second);
    }
    float first, second;
};

/// Returns the variance of the mean emission of a pixel if its samples were independent.
float independentVariance(const PixelEmission& emission, float weight) {
    const PixelEmission::Half &a = emission.halves[0], &b = emission.halves[1];
    const float mean = meanOf(a.emitted + b.emitted) / weight;
    return std::max((a.ee + b.ee) / weight - sqr(mean), 0.f) / std::max(weight - 1, 1.f);
}

/// Adds the variance of emission to that of the pixels.
void addEmission(const RecordedLight& light, std::span<const PixelCorrection> corrections,
                 HugeVector<float>& variance) {
    ItemsOfPixels<PixelCorrection> corrected(corrections);
    std::vector<float> ofPixels;
    double all = 0, independent = 0;
    for (const PixelEmission& emission : light.emission) {
        const Weights weights(light, emission.pixel);
        float ofPixel = 0;
        if (weights.haveBoth()) {
            ofPixel = independentVariance(emission, weights.all());
            independent += double(ofPixel);
            all += double(weights.varianceOfMean(meanOf(emission.halves[0].emitted),
                                                 meanOf(emission.halves[1].emitted)));
        }
        // More samples take the place of a fraction.
        for (const PixelCorrection& correction : corrected.of(emission.pixel))
            ofPixel *= 1 - correction.replaced;
        ofPixels.push_back(ofPixel);
    }
    const float factor = independent > 0 ? float(std::min(all / independent, 1.)) : 0;
    for (size_t i = 0; i < ofPixels.size(); ++i)
        variance[light.emission[i].pixel] += factor * ofPixels[i];
}

/// Returns the sum of the light of a half that is not shared, nor emission, nor rare: mean of the channels.
float unsharedLight(const RecordedLight& light, size_t pixel, int half,
                    std::span<const PixelEmission> emission, std::span<const PixelRareSample> rare) {
    float sum = light.radiance(pixel, half);
    for (const PixelEmission& ofPixel : emission)
        sum -= meanOf(ofPixel.halves[half].emitted);
    for (const PixelRareSample& sample : rare)
        if (int(sample.half) == half)
            sum -= meanOf(sample.albedo * sample.light);
    for (const LightPart part : kAllParts)
        if (light.parts.has(part))
            sum -= meanOf(light.light(part, pixel, half).light);
    return sum;
}

/// Returns the variance of parts that are not shared.
HugeVector<float> unsharedVariance(const RecordedLight& light) {
    const int width = light.pixelBounds.width(), height = light.pixelBounds.height();
    LanePlane plane(width, height), scratch(width, height);
    parallelFor(size_t(height), [&](size_t y) {
        const size_t begin = y * size_t(width), end = begin + size_t(width);
        ItemsOfPixels<PixelRareSample> rare(light.rare, begin);
        ItemsOfPixels<PixelEmission> emission(light.emission, begin);
        for (size_t i = begin; i < end; ++i) {
            const Weights weights(light, i);
            const auto rareOfPixel = rare.of(i);
            const auto emissionOfPixel = emission.of(i);
            float variance = 0;
            if (weights.haveBoth())
                variance = weights.varianceOfMean(unsharedLight(light, i, 0, emissionOfPixel, rareOfPixel),
                                                  unsharedLight(light, i, 1, emissionOfPixel, rareOfPixel));
            storeFloat4(plane.at(i), Float4{variance});
        }
    });
    WindowMean(width, height, kWindow).apply(plane, scratch);
    HugeVector<float> out(light.pixelCount());
    for (size_t i = 0; i < out.size(); ++i)
        out[i] = plane.at(i)[0];
    return out;
}

} // namespace

HugeVector<float> restVariance(const RecordedLight& light, std::span<const PixelCorrection> corrections) {
    HugeVector<float> variance = light.parts == LightParts::all() ? HugeVector<float>(light.pixelCount(), 0.f)
                                                                  : unsharedVariance(light);
    addEmission(light, corrections, variance);
    return variance;
}

} // namespace strobe
