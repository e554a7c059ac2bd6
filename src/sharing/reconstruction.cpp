#include "sharing/reconstruction.h"

#include "core/util/parallel.h"
#include "sharing/cell_estimates.h"
#include "sharing/rare_light.h"

#include <algorithm>

namespace strobe {

namespace {

constexpr int kCandidates = 1 + kFitScales;

/// Numbers over the pixel bounds, row by row.
struct Plane {
    int width, height;
    std::vector<float> values;
    Plane(int w, int h) : width(w), height(h), values(size_t(w) * size_t(h), 0.f) {}
    float* row(int y) { return values.data() + size_t(y) * size_t(width); }
};

STROBE_TARGET_CLONES void addScaled(const float* in, float factor, float* out, int n) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        out[i] += factor * in[i];
}

STROBE_TARGET_CLONES void multiply(const float* factors, float factor, float* out, int n) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        out[i] *= factors[i] * factor;
}

/// Gaussian means over windows of pixels. Weights outside of the image are left out.
class WindowMean {
  public:
    WindowMean(int width, int height, float sigma) : m_scratch(width, height), m_kernel(kernel(sigma)) {
        m_inverseX = inverseWeights(width);
        m_inverseY = inverseWeights(height);
    }
    /// Replaces each value of the plane by the mean around it.
    void apply(Plane& plane) {
        const int reach = int(m_kernel.size()) - 1, width = plane.width, height = plane.height;
        parallelFor(size_t(height), [&](size_t y) {
            float* out = m_scratch.row(int(y));
            const float* in = plane.row(int(y));
            std::fill(out, out + width, 0.f);
            for (int d = -std::min(reach, width - 1); d <= std::min(reach, width - 1); ++d)
                addScaled(in + std::max(d, 0), m_kernel[size_t(std::abs(d))], out + std::max(-d, 0),
                          width - std::abs(d));
        });
        parallelFor(size_t(height), [&](size_t line) {
            const int y = int(line);
            float* out = plane.row(y);
            std::fill(out, out + width, 0.f);
            for (int v = std::max(0, y - reach); v <= std::min(height - 1, y + reach); ++v)
                addScaled(m_scratch.row(v), m_kernel[size_t(std::abs(v - y))], out, width);
            multiply(m_inverseX.data(), m_inverseY[line], out, width);
        });
    }

  private:
    static std::vector<float> kernel(float sigma) {
        std::vector<float> out(size_t(std::ceil(3 * sigma)) + 1);
        for (size_t d = 0; d < out.size(); ++d)
            out[d] = std::exp(-sqr(float(d)) / (2 * sqr(sigma)));
        return out;
    }
    /// Returns the inverse of the sum of the kernel's weights around each of `length` positions.
    std::vector<float> inverseWeights(int length) const {
        const int reach = int(m_kernel.size()) - 1;
        std::vector<float> out(size_t(length), 0.f);
        for (int i = 0; i < length; ++i) {
            float weight = 0;
            for (int j = std::max(0, i - reach); j <= std::min(length - 1, i + reach); ++j)
                weight += m_kernel[size_t(std::abs(i - j))];
            out[size_t(i)] = 1 / weight;
        }
        return out;
    }

    Plane m_scratch;
    const std::vector<float> m_kernel;
    std::vector<float> m_inverseX, m_inverseY;
};

float sum(const Rgb& c) { return c.x + c.y + c.z; }

/// The standard deviation, in pixels, of the window over which errors are measured.
constexpr float kWindow = 2.5f;

/// Distributes the sum of the correction over the pixels, with the opposite sign and in proportion to their
/// squared errors, so that the sum becomes 0. Bright samples raise the measured error of the estimates that
/// contain them and lower their weights; without this step, the image would be too dark.
void restoreTotal(const std::vector<float>& error, std::vector<Rgb>& correction) {
    double total[3] = {}, errors = 0;
    for (size_t i = 0; i < correction.size(); ++i) {
        for (int c = 0; c < 3; ++c)
            total[c] += double(correction[i][c]);
        errors += double(error[i]);
    }
    if (errors > 0)
        for (size_t i = 0; i < correction.size(); ++i)
            for (int c = 0; c < 3; ++c)
                correction[i][c] -= float(total[c] * (double(error[i]) / errors));
}

/// Adds up candidates, each weighted by its inverse error.
class Mixture {
  public:
    /// Starts with the pixels' own estimates.
    Mixture(const RecordedLight& light, LightPart part)
        : m_light(light), m_part(part), m_width(light.pixelBounds.width()),
          m_height(light.pixelBounds.height()), m_window(m_width, m_height, kWindow),
          m_variance(m_width, m_height), m_bias(m_width, m_height), m_ownWeight(m_variance.values.size()),
          m_sharedWeight(m_ownWeight.size(), 0.f), m_difference(m_ownWeight.size()),
          m_sum(m_ownWeight.size(), Rgb(0)), m_widthSum(m_ownWeight.size(), 0.f) {
        measureOwn();
    }
    /// Adds a candidate: estimate(pixel, shared) writes the estimates of both halves. The variance of the
    /// mean of both halves follows from their squared difference; the squared bias of a shared estimate is
    /// the product of its differences from the own estimates of the other half, whose noise is independent.
    /// `width`: of the region of a pixel's estimate.
    template <class Estimate>
    void add(const Estimate& estimate, float width) {
        forPixels([&](size_t i) {
            Rgb shared[kHalves];
            estimate(i, shared);
            const Rgb a = own(i, 0), b = own(i, 1), d = shared[0] - shared[1];
            m_variance.values[i] = varianceFactor(i) * sum(d * d);
            m_bias.values[i] = sum((shared[0] - b) * (shared[1] - a));
            m_difference[i] = (shared[0] - a) * fraction(i, 0) + (shared[1] - b) * fraction(i, 1);
        });
        m_window.apply(m_variance);
        m_window.apply(m_bias);
        forPixels([&](size_t i) {
            const float w = 1 / (m_variance.values[i] + std::max(m_bias.values[i], 0.f) + kTiny);
            m_sum[i] += m_difference[i] * w;
            m_widthSum[i] += width * w;
            m_sharedWeight[i] += w;
        });
    }
    /// Returns the mixture. To be called once.
    SharedPart finish() {
        forPixels([&](size_t i) {
            const bool hasBoth = m_light.pixel(i, 0).count > 0 && m_light.pixel(i, 1).count > 0;
            const float shared = m_sharedWeight[i], variance = hasBoth ? 1 / (m_ownWeight[i] + shared) : 0;
            m_sum[i] *= variance;
            m_variance.values[i] = variance;
            m_widthSum[i] /= shared;
            m_sharedWeight[i] = shared * variance;
            m_ownWeight[i] = 1 / (3 * m_ownWeight[i]);
        });
        restoreTotal(m_variance.values, m_sum);
        for (float& variance : m_variance.values)
            variance /= 3;
        return {std::move(m_sum), std::move(m_sharedWeight), std::move(m_widthSum),
                std::move(m_variance.values), std::move(m_ownWeight)};
    }

  private:
    static constexpr float kTiny = 1e-12f;
    /// Measures the variance of the own estimates.
    ///
    /// Halves of a scrambled Sobol' sequence err in opposite directions where the light depends on few
    /// dimensions, so that their difference overestimates the variance of their mean: up to 8 times and more
    /// for direct light (measured). The quarters show by how much. For independent samples, their variance is
    /// twice that of the halves. The excess over this ratio counts four times: measured, a factor of 1.5
    /// shares too much direct light on the moving Killeroos and in moving-shadow.
    void measureOwn() {
        forPixels([&](size_t i) {
            const Rgb d = own(i, 0) - own(i, 1);
            m_variance.values[i] = varianceFactor(i) * sum(d * d);
            m_bias.values[i] = (varianceByQuarters(i, 0) + varianceByQuarters(i, 1)) / 2;
        });
        m_window.apply(m_variance);
        m_window.apply(m_bias);
        forPixels([&](size_t i) {
            const float byHalves = m_variance.values[i];
            const float ratio = m_bias.values[i] / (byHalves + kTiny);
            const float excess = m_part == LightPart::Direct ? std::max(1 + 4 * (ratio - 2), 1.f) : 1;
            m_ownWeight[i] = excess / (byHalves + kTiny);
        });
    }
    /// Returns the variance of the mean of a half that the difference of its quarters indicates.
    float varianceByQuarters(size_t pixel, int half) const {
        const HalfPixelSums& sums = m_light.pixel(pixel, half);
        if (sums.quarterCount == 0 || sums.quarterCount == sums.count)
            return 4 * m_variance.values[pixel]; // unknown: careful
        const float first = float(sums.quarterCount), second = float(sums.count - sums.quarterCount);
        const Rgb& quarter = sums.quarterLight[int(m_part)];
        const Rgb d = quarter * (1 / first) - (sums.light[int(m_part)] - quarter) * (1 / second);
        return first * second / sqr(first + second) * sum(d * d);
    }
    /// Returns the fraction of the pixel's samples that are in the half.
    float fraction(size_t pixel, int half) const {
        const float first = float(m_light.pixel(pixel, 0).count),
                    second = float(m_light.pixel(pixel, 1).count);
        return (half == 0 ? first : second) / std::max(first + second, 1.f);
    }
    /// Returns the variance of the mean of both halves relative to the variance of their difference.
    float varianceFactor(size_t pixel) const { return fraction(pixel, 0) * fraction(pixel, 1); }
    Rgb own(size_t pixel, int half) const {
        const HalfPixelSums& sums = m_light.pixel(pixel, half);
        return sums.count > 0 ? sums.mean(sums.light[int(m_part)]) : Rgb(0);
    }
    template <class Work>
    void forPixels(const Work& work) const {
        const size_t width = size_t(m_width);
        parallelFor(size_t(m_height), [&](size_t y) {
            for (size_t i = y * width; i < (y + 1) * width; ++i)
                work(i);
        });
    }

    const RecordedLight& m_light;
    const LightPart m_part;
    const int m_width, m_height;
    WindowMean m_window;
    Plane m_variance, m_bias;                       ///< of the current candidate
    std::vector<float> m_ownWeight, m_sharedWeight; ///< inverse errors; the sum over the shared estimates
    std::vector<Rgb> m_difference;                  ///< of the current candidate from the own estimate
    std::vector<Rgb> m_sum;                         ///< of the differences, weighted
    std::vector<float> m_widthSum;                  ///< weighted
};

/// Returns the width of the region of a candidate in edges of recorded cells.
float widthOf(int candidate) { return candidate == 0 ? 1 : fitWidth(candidate - 1); }

/// Returns the mean number of samples of a pixel.
float samplesPerPixel(const RecordedLight& light) {
    double samples = 0;
    for (const HalfPixelSums& half : light.pixels)
        samples += half.count;
    return float(samples * kHalves / double(light.pixels.size()));
}

} // namespace

struct LightSharing::Data {
    explicit Data(RecordedLight recorded);
    void addCommonLight();
    SharedPart shareCommonLight(LightPart part) const;
    void shareRareLight(LightPart part, std::vector<Rgb>& correction) const;

    RecordedLight light;
    CellPyramid pyramid;
    RareLight rare;
    std::vector<CellEstimate> estimates; ///< by cell
};

LightSharing::Data::Data(RecordedLight recorded)
    : light(std::move(recorded)), pyramid(light.cells), rare(pyramid, light.rare, samplesPerPixel(light)) {
    addCommonLight();
    estimates = estimateCells(pyramid);
}

/// Adds the light of the samples above RareLimits to the other light, as far as it is not rare.
void LightSharing::Data::addCommonLight() {
    for (const PixelRareSample& sample : light.rare) {
        const Rgb common = sample.light * (1 - rare.rarity(sample.cell, sample.part));
        pyramid.addLight(sample.cell, sample.part, int(sample.half), common);
        HalfPixelSums& sums = light.pixels[kHalves * sample.pixel + sample.half];
        sums.light[sample.part] += sample.albedo * common;
        if (sample.isInQuarter)
            sums.quarterLight[sample.part] += sample.albedo * common;
    }
}

SharedPart LightSharing::Data::shareCommonLight(LightPart part) const {
    Mixture mixture(light, part);
    for (int k = 0; k < kCandidates; ++k) {
        const auto estimate = [&, k](size_t pixel, Rgb(&shared)[kHalves]) {
            shared[0] = shared[1] = Rgb(0);
            for (const PixelUse& use : light.uses(pixel))
                shared[use.half] += use.albedo * estimates[use.cell].at(k, part, int(use.half));
            for (int half = 0; half < kHalves; ++half)
                shared[half] *= 1 / std::max(float(light.pixel(pixel, half).count), 1.f);
        };
        mixture.add(estimate, widthOf(k));
    }
    return mixture.finish();
}

/// Replaces the rare light of each pixel's own samples by that of the regions around its cells, scaled such
/// that the sum of the image remains.
void LightSharing::Data::shareRareLight(LightPart part, std::vector<Rgb>& correction) const {
    std::vector<Rgb> own(correction.size(), Rgb(0)), shared(correction.size(), Rgb(0));
    for (const PixelRareSample& sample : light.rare)
        if (sample.part == int(part))
            own[sample.pixel] += sample.albedo * sample.light * rare.rarity(sample.cell, sample.part);
    double ownTotal[3] = {}, sharedTotal[3] = {};
    for (size_t i = 0; i < correction.size(); ++i) {
        const float count = float(light.pixel(i, 0).count + light.pixel(i, 1).count);
        if (!(count > 0))
            continue;
        for (const PixelUse& use : light.uses(i))
            shared[i] += use.albedo * rare.light(use.cell, int(part)) * (1 / count);
        own[i] *= 1 / count;
        for (int c = 0; c < 3; ++c) {
            ownTotal[c] += double(own[i][c]);
            sharedTotal[c] += double(shared[i][c]);
        }
    }
    for (int c = 0; c < 3; ++c) {
        const float scale = sharedTotal[c] > 0 ? float(ownTotal[c] / sharedTotal[c]) : 0;
        for (size_t i = 0; i < correction.size(); ++i)
            correction[i][c] += shared[i][c] * scale - own[i][c];
    }
}

LightSharing::LightSharing(RecordedLight light) : m_data(new Data(std::move(light))) {}

LightSharing::~LightSharing() = default;

SharedPart LightSharing::share(LightPart part) const {
    SharedPart out = m_data->shareCommonLight(part);
    if (!m_data->light.rare.empty())
        m_data->shareRareLight(part, out.correction);
    return out;
}

} // namespace strobe
