#include "sharing/reconstruction.h"

#include "core/math/simd4.h"
#include "core/util/parallel.h"
#include "sharing/cell_estimates.h"
#include "sharing/errors/bright_pixels.h"
#include "sharing/errors/local_means.h"
#include "sharing/errors/squared_bias.h"
#include "sharing/errors/window_mean.h"
#include "sharing/rare_light.h"

#include <algorithm>

namespace strobe {

namespace {

constexpr int kLanes = CellEstimate::kLanes, kEstimates = CellEstimate::kCount;
/// The lane after those of the estimates: of the pixels' own values or of rare light.
constexpr int kOwn = kEstimates;
static_assert(kLanes == 4 && kLanes == LanePlane::kLanes && kOwn == kLanes - 1);

float sum(const Rgb& c) { return c.x + c.y + c.z; }

/// The standard deviation, in pixels, of the window over which errors are measured.
constexpr float kWindow = 2.5f;

/// Sums over pixels.
struct Totals {
    double rgb[3] = {}, errors = 0;
    void add(const Rgb& color) {
        for (int c = 0; c < 3; ++c)
            rgb[c] += double(color[c]);
    }
    void add(const Totals& other) {
        for (int c = 0; c < 3; ++c)
            rgb[c] += other.rgb[c];
        errors += other.errors;
    }
};

/// Calls addTo(totals, i) for all i below `count`. Returns the totals, which do not depend on the threads.
template <class AddTo>
Totals totalsOf(size_t count, const AddTo& addTo) {
    constexpr size_t kRun = 4096;
    std::vector<Totals> runs((count + kRun - 1) / kRun);
    parallelFor(runs.size(), [&](size_t run) {
        for (size_t i = run * kRun; i < std::min(count, (run + 1) * kRun); ++i)
            addTo(runs[run], i);
    });
    Totals all;
    for (const Totals& run : runs)
        all.add(run);
    return all;
}

/// Distributes the sum of the correction over the pixels, with the opposite sign and in proportion to their
/// errors, so that the sum becomes 0. Bright samples raise the measured error of the estimates that contain
/// them and lower their weights; without this step, the image would be too dark. In proportion to the squared
/// errors, a highlight would take back the sum of the whole image.
void restoreTotal(SharedPart& part) {
    const auto errorOf = [&](size_t i) { return double(std::sqrt(part.pixels[i].variance)); };
    const Totals totals = totalsOf(part.pixels.size(), [&](Totals& sum, size_t i) {
        sum.add(part.correction[i]);
        sum.errors += errorOf(i);
    });
    if (!(totals.errors > 0))
        return;
    parallelForRuns(part.pixels.size(), [&](size_t i) {
        const double share = errorOf(i) / totals.errors;
        for (int c = 0; c < 3; ++c)
            part.correction[i][c] -= float(totals.rgb[c] * share);
    });
}

float sum(const Float4& v) { return (v[0] + v[1]) + (v[2] + v[3]); }

/// Returns the widths of the regions of the estimates in edges of recorded cells.
Float4 estimateWidths() {
    Float4 out = {1};
    for (int scale = 0; scale < kFitScales; ++scale)
        out[1 + scale] = fitWidth(scale);
    return out;
}

/// Mixes the own values of pixels and the means of the estimates, each weighted by its inverse error.
class Mixture {
  public:
    /// Uses the part's light and the estimates here only.
    Mixture(const RecordedLight& light, LightPart part, const HugeBuffer<CellEstimate>& estimates)
        : m_light(light), m_part(part), m_width(light.pixelBounds.width()),
          m_height(light.pixelBounds.height()), m_variance(m_width, m_height),
          m_bias(m_width, m_height, kWindow), m_differences(size_t(m_width) * size_t(m_height)),
          m_halves(m_width, m_height), m_brightness(m_differences.size()) {
        forPixels([&](size_t i) {
            prefetch(i, estimates);
            m_brightness[i] = measure(i, estimates);
        });
        const BrightPixels bright(m_brightness, m_width, m_height);
        LanePlane scratch(m_width, m_height);
        averageVariance(bright, scratch);
        m_bias.average(bright, scratch);
    }
    /// Returns the mixture.
    SharedPart mix() {
        const size_t count = m_differences.size();
        SharedPart out{HugeVector<Rgb>(count), HugeBuffer<PixelSharing>(count)};
        // Samples of direct light are stratified over blocks of pixels: the noise of pixels is not
        // independent.
        LocalMeans means(m_width, m_height, m_part == LightPart::Indirect);
        means.compute([&](size_t i) { return mixPixel(i, out); });
        forPixels([&](size_t i) {
            if (const float variance = out.pixels[i].variance; variance > 0)
                out.correction[i] += limited(means.correction(i) * std::sqrt(variance), i);
        });
        restoreTotal(out);
        return out;
    }
    /// Returns the mean of the last lane of the estimates at a pixel.
    Rgb meanOfLastLane(size_t pixel) const {
        const auto& rgb = m_differences[pixel].of;
        return {rgb[0][kOwn], rgb[1][kOwn], rgb[2][kOwn]};
    }

  private:
    static constexpr float kTiny = 1e-12f;
    /// The differences of the estimates from the own value, and meanOfLastLane.
    struct Differences {
        alignas(16) float of[3][kLanes];
    };

    /// Requests what `measure` reads for later pixels: uses and estimates are spread over memory. GCC removes
    /// calls of functions that do nothing else, so that this one is always inlined.
    [[gnu::always_inline]] void prefetch(size_t pixel, const HugeBuffer<CellEstimate>& estimates) const {
        constexpr size_t kToUses = 16, kToEstimates = 8; // distances in pixels
        const size_t count = m_light.pixelCount();
        if (pixel + kToUses < count)
            __builtin_prefetch(m_light.uses(pixel + kToUses).data());
        if (pixel + kToEstimates < count)
            for (const PixelUse& use : m_light.uses(pixel + kToEstimates))
                __builtin_prefetch(&estimates[use.cell].light[use.half]);
    }
    /// Measures the errors at a pixel. Returns the brightness of its estimates. The variance of the mean of
    /// both halves follows from their squared difference; the squared bias of an estimate is the product of
    /// its differences from the own values of the other half, whose noise is independent.
    ///
    /// Halves of a scrambled Sobol' sequence err in opposite directions where the light depends on few
    /// dimensions, so that their difference overestimates the variance of their mean: up to 8 times and more
    /// for direct light (measured). The quarters show by how much.
    Brightness measure(size_t pixel, const HugeBuffer<CellEstimate>& estimates) {
        Float4 sums[kHalves][3] = {};
        for (const PixelUse& use : m_light.uses(pixel)) {
            const auto& estimate = estimates[use.cell].light[use.half];
            for (int c = 0; c < 3; ++c)
                sums[use.half][c] += use.albedo[c] * loadFloat4(estimate[c]);
        }
        const HalfPart &first = m_light.light(m_part, pixel, 0), &second = m_light.light(m_part, pixel, 1);
        const HalfWeights &ofFirst = m_light.weights(pixel, 0), &ofSecond = m_light.weights(pixel, 1);
        const float weights[kHalves] = {float(ofFirst.all), float(ofSecond.all)};
        const float inverses[kHalves] = {1 / std::max(weights[0], 1.f), 1 / std::max(weights[1], 1.f)};
        const float inverse = 1 / std::max(weights[0] + weights[1], 1.f);
        const float fractions[kHalves] = {weights[0] * inverse, weights[1] * inverse};
        Float4 variance = {}, bias = {}, halves = {}, brightnessA = {}, brightnessB = {};
        for (int c = 0; c < 3; ++c) {
            const float ownA = first.light[c] * inverses[0], ownB = second.light[c] * inverses[1];
            Float4 a = sums[0][c] * inverses[0], b = sums[1][c] * inverses[1];
            brightnessA += a;
            brightnessB += b;
            a[kOwn] = ownA;
            b[kOwn] = ownB;
            variance += (a - b) * (a - b);
            halves += a - b;
            bias += (a - ownB) * (b - ownA);
            Float4 difference = (a - ownA) * fractions[0] + (b - ownB) * fractions[1];
            difference[kOwn] = (sums[0][c][kOwn] + sums[1][c][kOwn]) * inverse;
            storeFloat4(m_differences[pixel].of[c], difference);
        }
        storeFloat4(m_halves.at(pixel), std::sqrt(fractions[0] * fractions[1]) * halves);
        variance *= fractions[0] * fractions[1];
        const float own = variance[kOwn];
        const float varianceA = varianceByQuarters(first, ofFirst, own),
                    varianceB = varianceByQuarters(second, ofSecond, own);
        Float4 squaredErrors = errorsOfProducts(bias, varianceA, varianceB);
        bias[kOwn] = (varianceA + varianceB) / 2;
        squaredErrors[kOwn] = 0;
        storeFloat4(m_variance.at(pixel), variance);
        m_bias.set(pixel, bias, squaredErrors);
        return brightnessOf(brightnessA, brightnessB);
    }
    /// Returns the brightness of a pixel from the estimates by its halves.
    static Brightness brightnessOf(Float4 first, Float4 second) {
        first[kOwn] = second[kOwn] = 0;
        return {std::max(sum(first + second) / 2, 0.f), std::max(sum(first < second ? first : second), 0.f)};
    }
    void averageVariance(const BrightPixels& bright, LanePlane& scratch) {
        const WindowMean window(m_width, m_height, kWindow);
        const BrightMeans ofBright(m_variance, window, bright);
        ofBright.fade(m_variance);
        window.apply(m_variance, scratch);
        ofBright.write(m_variance);
    }
    /// Returns the variance of the mean of a half that the difference of its quarters indicates, with that of
    /// the pixel by the difference of its halves.
    static float varianceByQuarters(const HalfPart& half, const HalfWeights& weights, float byHalves) {
        if (weights.quarter <= 0 || weights.quarter >= weights.all)
            return 4 * byHalves; // unknown: careful
        const float first = float(weights.quarter), second = float(weights.all - weights.quarter);
        const Rgb& quarter = half.quarterLight;
        const Rgb d = quarter * (1 / first) - (half.light - quarter) * (1 / second);
        return first * second / sqr(first + second) * sum(d * d);
    }
    /// Returns the expected squared errors of products of the differences of two halves whose own values have
    /// these variances; at most the squares of the products. Half of what the variances give measured best.
    static Float4 errorsOfProducts(const Float4& products, float varianceA, float varianceB) {
        const Float4 zero = {}, squares = products * products;
        const Float4 sizes = products > zero ? products : -products;
        const Float4 expected = (varianceA * varianceB + sizes * ((varianceA + varianceB) / 2)) / 2;
        return squares < expected ? squares : expected;
    }
    /// Returns by how much halves of direct light err in opposite directions: the excess of the ratio between
    /// the variances by quarters and by halves, which is 2 for independent samples.
    float excessOf(float byHalves, float byQuarters) const {
        return m_part == LightPart::Direct ? std::max(byQuarters / (byHalves + kTiny) - 2, 0.f) : 0;
    }
    /// Returns the squared error of the mean of the estimates with these weights. Their regions contain each
    /// other, so that their biases have one sign and add up. Those of direct light count as independent
    /// (measured).
    float errorOfMean(const Float4& weights, const Float4& variance, const Float4& squaredBias) const {
        const Float4 squares = weights * weights;
        if (m_part == LightPart::Direct)
            return sum(squares * (variance + squaredBias));
        float bias = 0;
        for (int k = 0; k < kEstimates; ++k)
            bias += weights[k] * std::sqrt(squaredBias[k]);
        return sum(squares * variance) + sqr(bias);
    }
    /// Returns a correction of LocalMeans, limited such that it lowers the light of the pixel by less than a
    /// third. Where bright samples are few, a window may have none by chance.
    Rgb limited(const Rgb& correction, size_t pixel) const {
        constexpr float kMost = 0.3f;
        const float lowered = -sum(correction), most = kMost / kEstimates * m_brightness[pixel].mean;
        return lowered > most ? correction * (most / lowered) : correction;
    }
    /// Mixes a pixel, and writes it to `out`.
    MixedPixel mixPixel(size_t i, SharedPart& out) {
        const Float4 variance = loadFloat4(m_variance.at(i)), bias = m_bias.at(i);
        const Float4 zero = {};
        const bool hasBoth = m_light.weights(i, 0).all > 0 && m_light.weights(i, 1).all > 0;
        // A background has no light to share, and nothing is better than a value without noise.
        if (!hasBoth || m_light.uses(i).empty() || !(variance[kOwn] > 0)) {
            out.correction[i] = Rgb(0);
            out.pixels[i] = {};
            return {};
        }
        const Float4 squaredBias = bias > zero ? bias : zero;
        Float4 weights = 1 / (variance + squaredBias + kTiny);
        weights[kOwn] = 0;
        weights /= sum(weights);
        const float shared = 1 / (errorOfMean(weights, variance, squaredBias) + kTiny);
        Rgb difference;
        for (int c = 0; c < 3; ++c)
            difference[c] = shared * sum(weights * loadFloat4(m_differences[i].of[c]));
        // Halves that err in opposite directions show too much variance of own values: by about four times
        // the excess. In the weight of a pixel, the excess counts once: with four times, less light is
        // shared, and meadow has 1.2 times the error.
        constexpr float kFullExcess = 4;
        const float excess = excessOf(variance[kOwn], bias[kOwn]), full = 1 + kFullExcess * excess;
        const float own = (1 + excess) / (variance[kOwn] + kTiny);
        const float error = 1 / (own + shared), weight = shared * error;
        out.correction[i] = difference * error;
        const float ownError = variance[kOwn] / full;
        out.pixels[i] = {weight, sum(weights * m_widths), error / 3, ownError / 3,
                         (sqr(weight) / shared + sqr(1 - weight) * ownError) / 3};
        const Float4 halves = loadFloat4(m_halves.at(i));
        return {-out.correction[i], std::sqrt(error / 3), halves[kOwn] / full,
                weight * (halves[kOwn] - sum(weights * halves))};
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
    const Float4 m_widths = estimateWidths();
    /// By estimate; the last lanes are the variance of the own values by halves and by quarters.
    LanePlane m_variance;
    SquaredBias m_bias;
    HugeBuffer<Differences> m_differences;
    /// By estimate, the difference between both halves, and in the last lane that of own values. Summed over
    /// the channels and scaled as in MixedPixel.
    LanePlane m_halves;
    HugeBuffer<Brightness> m_brightness;
};

/// Returns the mean number of samples of a pixel.
float samplesPerPixel(const RecordedLight& light) {
    double samples = 0;
    for (size_t pixel = 0; pixel < light.pixelCount(); ++pixel)
        samples += light.weight(pixel);
    return float(samples / double(light.pixelCount()));
}

} // namespace

struct LightSharing::Data {
    explicit Data(RecordedLight recorded);
    SharedPart share(LightPart part);
    void shareRareLight(LightPart part, const Mixture& mixture, SharedPart& out) const;

    RecordedLight light;
    RareLight rare[kParts];
    CellEstimates estimates; ///< the last lanes: rare light
};

LightSharing::Data::Data(RecordedLight recorded) : light(std::move(recorded)) {
    CellPyramid pyramid(light.cells, light.parts);
    light.freeCells(); // the pyramid has their sums
    const std::vector<uint32_t> cells = pyramid.cellsByNode();
    const float samples = samplesPerPixel(light);
    for (const LightPart part : kAllParts)
        rare[int(part)] = RareLight(pyramid, cells, light.rare, part, samples);
    addCommonLight(rare, light, pyramid);
    estimates = estimateCells(pyramid, cells);
    for (int part = 0; part < kParts; ++part) {
        if (rare[part].isEmpty())
            continue;
        parallelForRuns(estimates.parts[part].size(), [&](size_t cell) {
            const Rgb rareLight = rare[part].light(uint32_t(cell));
            for (auto& half : estimates.parts[part][cell].light)
                for (int c = 0; c < 3; ++c)
                    half[c][kOwn] = rareLight[c];
        });
    }
}

SharedPart LightSharing::Data::share(LightPart part) {
    Mixture mixture(light, part, estimates.parts[int(part)]);
    HugeBuffer<CellEstimate>().swap(estimates.parts[int(part)]); // the mixture has measured them
    light.freeLight(part);
    SharedPart out = mixture.mix();
    if (!rare[int(part)].isEmpty())
        shareRareLight(part, mixture, out);
    return out;
}

/// Replaces the rare light of each pixel's own samples, as far as it is spread, by that of the regions around
/// its cells, scaled such that the sum of the image remains.
void LightSharing::Data::shareRareLight(LightPart part, const Mixture& mixture, SharedPart& out) const {
    Totals own;
    for (const PixelRareSample& sample : light.rare)
        if (sample.part == int(part)) {
            const float weight = float(light.weight(sample.pixel));
            const RareLight& ofPart = rare[sample.part];
            const float fraction = ofPart.rarity(sample.cell) * ofPart.spread(sample.cell);
            const Rgb rareLight = sample.albedo * sample.light * (fraction / std::max(weight, 1.f));
            own.add(rareLight);
            out.correction[sample.pixel] -= rareLight;
        }
    const Totals shared =
        totalsOf(out.correction.size(), [&](Totals& sum, size_t i) { sum.add(mixture.meanOfLastLane(i)); });
    Rgb scale;
    for (int c = 0; c < 3; ++c)
        scale[c] = shared.rgb[c] > 0 ? float(own.rgb[c] / shared.rgb[c]) : 0;
    parallelForRuns(out.correction.size(), [&](size_t i) {
        constexpr float kSamples = 10; // in regions of five (median of eight scenes), which overlap
        const Rgb rareLight = mixture.meanOfLastLane(i) * scale;
        out.correction[i] += rareLight;
        out.pixels[i].error += sum(rareLight * rareLight) / (3 * kSamples);
    });
}

LightSharing::LightSharing(RecordedLight light) : m_data(new Data(std::move(light))) {}

LightSharing::~LightSharing() = default;

SharedPart LightSharing::share(LightPart part) { return m_data->share(part); }

} // namespace strobe
