// Compares the errors and the times of two integrators over many seeds. See bench/README.md.
#include "bench/measure.h"
#include "bench/recording.h"
#include "core/math/hash.h"
#include "core/render/render.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <array>
#include <numbers>

namespace strobe::bench {
namespace {

/// The command line arguments.
struct Settings {
    std::filesystem::path scene;
    std::string integrator = "adaptive-cache";
    BuildOptions build;
    std::vector<std::string> integratorDefines;
    std::vector<int> resolution = {200, 150}, samples = {1, 4, 16, 64, 256}, seeds = {64};
    int referenceSamples = 2048;
    /// Compares with supersample in the same time, instead of with the same number of samples.
    bool hasEqualTime = false;
};

/// The errors of an image. Each is the mean over pixels and channels.
/// The last two are those of means over blocks of pixels, clipped to 1: of the image scaled down.
enum class Error { Clipped, Raw, Relative, Structural, Blocks4, Blocks16 };
constexpr int kErrors = 6, kErrorsOfPixels = 4;

/// Two independent images. The mean product of the differences from both is the squared error of an image
/// without the noise of the reference.
struct Reference {
    Image first, second;
};

/// The errors of an image and its squared errors by tile, clipped to 1.
struct Errors {
    std::array<double, kErrors> of{};
    std::vector<double> tiles;
    double total = 0; ///< of the image
};

constexpr int kTileSize = 16; ///< pixels

double clipped(double value) { return std::clamp(value, 0.0, 1.0); }

double structuralDissimilarity(const Image& image, const Reference& reference);

/// Returns the squared error of the means over blocks of `edge` pixels, of radiance clipped to 1.
double errorOfBlocks(const Image& image, const Reference& reference, int edge) {
    double sum = 0;
    for (int top = 0; top < image.height; top += edge)
        for (int left = 0; left < image.width; left += edge)
            for (int c = 0; c < 3; ++c) {
                double toFirst = 0, toSecond = 0;
                int count = 0;
                for (int y = top; y < std::min(top + edge, image.height); ++y)
                    for (int x = left; x < std::min(left + edge, image.width); ++x, ++count) {
                        const size_t i = size_t(y) * size_t(image.width) + size_t(x);
                        const double v = clipped(double(image.pixels[i][c]));
                        toFirst += v - clipped(double(reference.first.pixels[i][c]));
                        toSecond += v - clipped(double(reference.second.pixels[i][c]));
                    }
                sum += toFirst * toSecond / count;
            }
    return sum / (3 * double(image.pixels.size()));
}

Errors errorsOf(const Image& image, const Reference& reference) {
    const int columns = (image.width + kTileSize - 1) / kTileSize,
              rows = (image.height + kTileSize - 1) / kTileSize;
    Errors out;
    out.tiles.resize(size_t(columns) * size_t(rows));
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const size_t i = size_t(y) * size_t(image.width) + size_t(x);
            for (int c = 0; c < 3; ++c) {
                const double v = double(image.pixels[i][c]), a = double(reference.first.pixels[i][c]),
                             b = double(reference.second.pixels[i][c]);
                const double cut = (clipped(v) - clipped(a)) * (clipped(v) - clipped(b)),
                             raw = (v - a) * (v - b);
                out.of[int(Error::Clipped)] += cut;
                out.of[int(Error::Raw)] += raw;
                out.of[int(Error::Relative)] += raw / (sqr((a + b) / 2) + 0.01);
                out.tiles[size_t(y / kTileSize) * size_t(columns) + size_t(x / kTileSize)] += cut;
                out.total += v;
            }
        }
    for (double& error : out.of)
        error /= double(image.pixels.size()) * 3;
    out.of[int(Error::Structural)] = structuralDissimilarity(image, reference);
    out.of[int(Error::Blocks4)] = errorOfBlocks(image, reference, 4);
    out.of[int(Error::Blocks16)] = errorOfBlocks(image, reference, 16);
    return out;
}

/// The moments of a window of an image and of both references.
struct WindowMoments {
    double x = 0, a = 0, b = 0, xx = 0, ab = 0, xa = 0, xb = 0; ///< means
    void add(double image, double first, double second) {
        x += image / kPixels;
        a += first / kPixels;
        b += second / kPixels;
        xx += image * image / kPixels;
        ab += first * second / kPixels;
        xa += image * first / kPixels;
        xb += image * second / kPixels;
    }
    /// Returns 1 - SSIM (Wang et al., "Image Quality Assessment", 2004). The variance of the reference is the
    /// covariance of both references, and its squared mean is the product of both means, so that their noise
    /// drops out.
    double dissimilarity() const {
        constexpr double kC1 = 1e-4, kC2 = 9e-4;
        const double y = (a + b) / 2, yy = std::max(a * b, 0.0);
        const double vx = xx - x * x, vy = std::max(ab - a * b, 0.0), cov = (xa + xb) / 2 - x * y;
        return 1 - (2 * x * y + kC1) * (2 * cov + kC2) / ((x * x + yy + kC1) * (vx + vy + kC2));
    }
    static constexpr int kWindow = 8; ///< edge in pixels
    static constexpr double kPixels = kWindow * kWindow;
};

/// Returns the mean of (1 - SSIM) / 2 of the clipped luminance over windows of 8x8 pixels.
double structuralDissimilarity(const Image& image, const Reference& reference) {
    constexpr int kWindow = WindowMoments::kWindow;
    double sum = 0;
    int windows = 0;
    const auto at = [](const Image& from, size_t i) { return clipped(double(luminance(from.pixels[i]))); };
    for (int top = 0; top + kWindow <= image.height; top += kWindow / 2)
        for (int left = 0; left + kWindow <= image.width; left += kWindow / 2, ++windows) {
            WindowMoments moments;
            for (int v = top; v < top + kWindow; ++v)
                for (int u = left; u < left + kWindow; ++u) {
                    const size_t i = size_t(v) * size_t(image.width) + size_t(u);
                    moments.add(at(image, i), at(reference.first, i), at(reference.second, i));
                }
            sum += moments.dissimilarity();
        }
    return windows > 0 ? sum / (2 * windows) : 0;
}

/// Renders with one thread. Adds the CPU seconds to `seconds`.
Image renderOnce(const BuiltScene& built, int samples, uint64_t seed, double& seconds,
                 std::string* note = nullptr) {
    RenderSettings settings;
    settings.samplesPerPixel = samples;
    settings.seed = seed;
    settings.threads = 1;
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    const Cost cost = measure([&] {
        const RenderStats stats = render(*built.scene, *built.integrator, *built.shader,
                                         *built.sampler.sampler, *built.filter, settings, film);
        if (note)
            *note = stats.integratorNote;
    });
    seconds = cost.cpu;
    return film.image();
}

/// The results of one integrator, by seed.
struct Results {
    std::vector<Errors> errors;
    std::vector<double> seconds;
    double meanError(int k) const {
        double sum = 0;
        for (const Errors& e : errors)
            sum += e.of[size_t(k)];
        return sum / double(errors.size());
    }
};

/// The mean and the standard deviation of some numbers.
struct Moments {
    double mean = 0, deviation = 0;
    explicit Moments(const std::vector<double>& values) {
        for (const double v : values)
            mean += v / double(values.size());
        for (const double v : values)
            deviation += sqr(v - mean) / std::max(double(values.size()) - 1, 1.0);
        deviation = std::sqrt(deviation);
    }
};

/// Returns the 95 % quantile of Student's t distribution (Cornish-Fisher expansion).
double studentQuantile(double degrees) {
    constexpr double z = 1.6448536;
    return z + (z * z * z + z) / (4 * degrees) +
           (5 * std::pow(z, 5) + 16 * z * z * z + 3 * z) / (96 * sqr(degrees));
}

/// The gain of an integrator: the product of error and time of the base divided by that of the integrator.
struct Gain {
    double mean = 0;       ///< geometric, over the seeds
    double upperBound = 0; ///< of its inverse: one-sided, 95 %; 0: unknown
};

/// Returns the gain by the k-th error, from the logarithms of the ratios of the seeds. Noise of the
/// references can make errors negative. Such seeds are left out of the bound, and the mean is that of mean
/// errors.
Gain gainOf(const Results& base, const Results& other, int k, double timeRatio) {
    std::vector<double> logs;
    for (size_t i = 0; i < base.errors.size(); ++i) {
        const double ratio = other.errors[i].of[size_t(k)] / base.errors[i].of[size_t(k)];
        if (base.errors[i].of[size_t(k)] > 0 && ratio > 0)
            logs.push_back(std::log(ratio * other.seconds[i] / base.seconds[i]));
    }
    Gain gain;
    if (logs.size() >= 2) {
        const Moments m(logs);
        const double n = double(logs.size());
        gain.mean = std::exp(-m.mean);
        gain.upperBound = std::exp(m.mean + studentQuantile(n - 1) * m.deviation / std::sqrt(n));
    }
    if (logs.size() < base.errors.size())
        gain.mean = base.meanError(k) / (other.meanError(k) * timeRatio);
    return gain;
}

/// Returns the probability that a variable with Student's t distribution exceeds t (Abramowitz and Stegun
/// 1964, 26.7.3 and 26.7.4).
double studentTail(double t, int degrees) {
    const double angle = std::atan(t / std::sqrt(double(degrees))), squaredCosine = sqr(std::cos(angle));
    const bool isOdd = degrees % 2 == 1;
    double term = isOdd ? std::cos(angle) : 1, sum = 0;
    for (int k = isOdd ? 1 : 0; k <= degrees - 2; k += 2) {
        sum += term;
        term *= squaredCosine * double(k + 1) / double(k + 2);
    }
    const double series = std::sin(angle) * sum;
    return (1 - (isOdd ? 2 / std::numbers::pi * (angle + series) : series)) / 2;
}

/// Returns the fraction of tiles whose error times time is significantly larger: a paired t-test per tile, at
/// a false discovery rate of 5 % (Benjamini and Hochberg 1995). `timeRatio`: 1 compares the errors alone.
double worseTiles(const Results& base, const Results& other, double timeRatio) {
    const size_t tiles = base.errors.front().tiles.size();
    std::vector<double> p;
    for (size_t tile = 0; tile < tiles; ++tile) {
        std::vector<double> differences;
        for (size_t i = 0; i < base.errors.size(); ++i)
            differences.push_back(other.errors[i].tiles[tile] * timeRatio - base.errors[i].tiles[tile]);
        const Moments m(differences);
        const auto n = double(differences.size());
        const double t = m.deviation > 0 ? m.mean / m.deviation * std::sqrt(n) : 0;
        p.push_back(n > 1 ? studentTail(t, int(n) - 1) : 0.5);
    }
    std::sort(p.begin(), p.end());
    size_t count = 0;
    for (size_t i = 0; i < p.size(); ++i)
        if (p[i] <= 0.05 * double(i + 1) / double(p.size()))
            count = i + 1;
    return double(count) / double(tiles);
}

/// Returns the errors between those of two results of one seed, at a fraction of the logarithm of their
/// times: a power law. The noise of the references can make errors negative: then, and for tiles, between the
/// errors in the same way as between the mean errors.
Errors errorsBetween(const Errors& fewer, const Errors& more, double fraction,
                     const std::array<double, kErrors>& weightOfMore) {
    Errors out = fewer;
    for (size_t k = 0; k < kErrors; ++k) {
        const double a = fewer.of[k], b = more.of[k];
        out.of[k] = a > 0 && b > 0 ? a * std::pow(b / a, fraction) : a + weightOfMore[k] * (b - a);
    }
    for (size_t tile = 0; tile < out.tiles.size(); ++tile)
        out.tiles[tile] += weightOfMore[size_t(Error::Clipped)] * (more.tiles[tile] - fewer.tiles[tile]);
    return out;
}

/// Returns the results of an integrator in the time of another one, given those with fewer and with more
/// samples.
Results resultsInTimeOf(const Results& other, const Results& fewer, const Results& more) {
    const double time = median(other.seconds) / median(fewer.seconds);
    const double fraction = std::log(time) / std::log(median(more.seconds) / median(fewer.seconds));
    std::array<double, kErrors> weightOfMore{};
    for (int k = 0; k < kErrors; ++k) {
        const double a = fewer.meanError(k), b = more.meanError(k);
        weightOfMore[size_t(k)] = a > b && b > 0 ? (1 - std::pow(b / a, fraction)) / (1 - b / a) : fraction;
    }
    Results out;
    for (size_t seed = 0; seed < fewer.errors.size(); ++seed) {
        out.errors.push_back(errorsBetween(fewer.errors[seed], more.errors[seed], fraction, weightOfMore));
        out.seconds.push_back(fewer.seconds[seed] * time);
    }
    return out;
}

/// Returns the time of `other` relative to that of `base`.
double timeRatioOf(const BuiltScene& base, const BuiltScene& other, int samples) {
    constexpr uint64_t kRenders = 3;
    std::vector<double> ratios;
    for (uint64_t i = 0; i < kRenders; ++i) {
        double ofBase, ofOther;
        renderOnce(base, samples, hashOf(3, i), ofBase);
        renderOnce(other, samples, hashOf(3, i), ofOther);
        ratios.push_back(ofOther / ofBase);
    }
    return median(ratios);
}

void compare(const Settings& settings, const BuiltScene& base, const BuiltScene& other,
             const Reference& reference, size_t index) {
    const int samples = settings.samples[index];
    const int seeds = settings.seeds[std::min(index, settings.seeds.size() - 1)];
    const double timeOfSame = settings.hasEqualTime ? timeRatioOf(base, other, samples) : 1;
    const double fewer = std::exp2(std::floor(std::log2(timeOfSame)));
    const int baseSamples = std::max(int(fewer * samples), 1);
    Results a, b, more;
    std::string note;
    std::vector<double> totals;
    const auto add = [&](const BuiltScene& scene, int count, uint64_t seed, Results& out) {
        double seconds = 0;
        out.errors.push_back(errorsOf(renderOnce(scene, count, seed, seconds, &note), reference));
        out.seconds.push_back(seconds);
    };
    for (uint64_t seed = 0; seed < uint64_t(seeds); ++seed) {
        add(base, baseSamples, seed, a);
        if (settings.hasEqualTime)
            add(base, 2 * baseSamples, seed, more);
        add(other, samples, seed, b);
        totals.push_back(b.errors.back().total / a.errors.back().total - 1);
    }
    if (settings.hasEqualTime)
        a = resultsInTimeOf(b, a, more);
    const double timeRatio = median(b.seconds) / median(a.seconds);
    const Moments total(totals);
    fmt::print("{},{},{},{},{:.5f},{:.4f}", settings.scene.stem().string(), settings.build.shading, samples,
               seeds, median(a.seconds), settings.hasEqualTime ? timeOfSame : timeRatio);
    const auto printGains = [&](int first, int end) {
        for (int k = first; k < end; ++k) {
            const Gain gain = gainOf(a, b, k, timeRatio);
            fmt::print(",{:.4g},{:.4f}", gain.mean, gain.upperBound);
        }
    };
    printGains(0, kErrorsOfPixels);
    fmt::print(",{:.4f},{:.4f},{:.6f},{:.6f},{:.4g},{:.4g}", worseTiles(a, b, timeRatio), worseTiles(a, b, 1),
               total.mean, total.deviation / std::sqrt(double(seeds)), a.meanError(0), b.meanError(0));
    printGains(kErrorsOfPixels, kErrors);
    fmt::print(",{}\n", note);
    std::fflush(stdout);
}

int run(Settings settings) {
    settings.build.resolution = V2i(settings.resolution[0], settings.resolution[1]);
    const auto load = [&](const std::string& integrator, const std::vector<std::string>& defines) {
        BuildOptions options = settings.build;
        options.integrator = integrator;
        options.defines.insert(options.defines.end(), defines.begin(), defines.end());
        return loadScene(settings.scene, options, 1).built;
    };
    const BuiltScene base = load("supersample", {}),
                     other = load(settings.integrator, settings.integratorDefines);
    double seconds;
    const Reference reference{renderOnce(base, settings.referenceSamples, hashOf(1), seconds),
                              renderOnce(base, settings.referenceSamples, hashOf(2), seconds)};
    renderOnce(other, 1, 0, seconds); // loads textures, as the references do for `base`
    for (size_t i = 0; i < settings.samples.size(); ++i)
        compare(settings, base, other, reference, i);
    return 0;
}

} // namespace
} // namespace strobe::bench

int main(int argc, char** argv) {
    strobe::bench::Settings settings;
    settings.build.shading = "path";
    CLI::App app(
        "strobe_gains: errors and times of an integrator beside those of supersample. Prints, as CSV, for "
        "each number of samples: scene, shading, samples, seeds, seconds of supersample, time ratio with "
        "the same number of samples; gain and upper bound of its inverse for the error clipped to 1, raw, "
        "relative and structural; fraction of tiles that are worse, and of those that are worse without "
        "regard to time; relative difference of the sum of the image and its standard error; both clipped "
        "errors; gains and upper bounds for the errors of means over blocks of 4x4 and 16x16 pixels, "
        "clipped; note of the integrator");
    app.add_option("scene", settings.scene, "scene file")->required()->check(CLI::ExistingFile);
    app.add_option("--integrator", settings.integrator);
    app.add_option("--shading", settings.build.shading);
    app.add_option("-D,--define", settings.build.defines, "name=value")->take_all();
    app.add_option("--integrator-define", settings.integratorDefines, "name=value, of the integrator alone")
        ->take_all();
    app.add_option("--resolution", settings.resolution, "width and height")->expected(2);
    app.add_option("--spp", settings.samples, "numbers of samples per pixel")->delimiter(',');
    app.add_option("--seeds", settings.seeds, "numbers of seeds, by number of samples; the last is repeated")
        ->delimiter(',');
    app.add_option("--reference-spp", settings.referenceSamples, "samples of each of the two references");
    app.add_flag(
        "--equal-time", settings.hasEqualTime,
        "compare with supersample in the same time: by renders with fewer and with more samples, and a "
        "power law between their errors");
    CLI11_PARSE(app, argc, argv);
    return strobe::bench::guarded([&] { return strobe::bench::run(settings); });
}
