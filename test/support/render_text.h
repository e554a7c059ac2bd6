// Renders scene texts, and computes statistics of images.
#pragma once

#include "core/render/render.h"
#include "core/util/diagnostics.h"
#include "loader/build/builder.h"
#include "loader/parser/parser.h"

#include <cmath>
#include <string>
#include <vector>

namespace strobe::test {

/// Builds a scene from a text in the .scene mode.
inline BuiltScene build(const std::string& text, const BuildOptions& options = {}) {
    Diagnostics quiet;
    return buildScene(parseText(text, "test.scene", {"supersample"}, quiet), options, quiet);
}

struct Rendered {
    Image image;
    RenderStats stats;
};

inline Rendered render(const BuiltScene& built, uint64_t seed = 0, int threads = 2, int tile = 16) {
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.seed = seed;
    settings.threads = threads;
    settings.tileSize = tile;
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    Rendered out;
    out.stats = strobe::render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                               *built.filter, settings, film);
    out.image = film.image();
    return out;
}

/// Mean and standard error of each pixel and channel over independent seeds.
struct PixelStatistics {
    int width = 0, height = 0, seeds = 0;
    std::vector<double> mean, error; ///< 3 per pixel

    double meanOf(int x, int y, int c = 0) const { return mean[(size_t(y) * width + x) * 3 + c]; }
    double errorOf(int x, int y, int c = 0) const { return error[(size_t(y) * width + x) * 3 + c]; }
};

/// Renders with `seeds` consecutive seeds.
inline PixelStatistics renderSeeds(const BuiltScene& built, int seeds, uint64_t firstSeed = 0) {
    PixelStatistics s;
    s.seeds = seeds;
    std::vector<double> sum;
    std::vector<double> sum2;
    for (int i = 0; i < seeds; ++i) {
        const Image image = render(built, firstSeed + uint64_t(i)).image;
        s.width = image.width;
        s.height = image.height;
        sum.resize(image.pixels.size() * 3);
        sum2.resize(sum.size());
        for (size_t p = 0; p < image.pixels.size(); ++p)
            for (int c = 0; c < 3; ++c) {
                const double v = image.pixels[p][c];
                sum[p * 3 + c] += v;
                sum2[p * 3 + c] += v * v;
            }
    }
    for (size_t i = 0; i < sum.size(); ++i) {
        const double mean = sum[i] / seeds;
        s.mean.push_back(mean);
        s.error.push_back(std::sqrt(std::max(0.0, sum2[i] / seeds - mean * mean) / (seeds - 1)));
    }
    return s;
}

/// The mean over all pixels and channels, and its standard error over independent seeds.
struct Estimate {
    double mean, error;
};

inline Estimate meanOverSeeds(const BuiltScene& built, int seeds) {
    double sum = 0;
    double sum2 = 0;
    for (int s = 0; s < seeds; ++s) {
        const Image image = render(built, uint64_t(s)).image;
        double mean = 0;
        for (const Rgb& p : image.pixels)
            mean += (double(p.x) + p.y + p.z) / 3;
        mean /= double(image.pixels.size());
        sum += mean;
        sum2 += mean * mean;
    }
    const double mean = sum / seeds;
    return {mean, std::sqrt(std::max(0.0, sum2 / seeds - mean * mean) / (seeds - 1))};
}

/// Returns the number of standard errors that at least one of n independent tests exceeds with probability
/// 1e-4 (Šidák), for means of `seeds` values: the quantile of Student's t, approximated by the normal
/// quantile with a Cornish-Fisher correction.
inline double criticalZ(size_t n, int seeds) {
    const double alpha = 1 - std::pow(1 - 1e-4, 1.0 / double(n));
    double lo = 0;
    double hi = 40;
    for (int i = 0; i < 80; ++i) {
        const double mid = (lo + hi) / 2;
        (std::erfc(mid / std::sqrt(2.0)) > alpha ? lo : hi) = mid;
    }
    const double z = lo;
    const double v = seeds - 1; // degrees of freedom
    return z + (z * z * z + z) / (4 * v) + (5 * std::pow(z, 5) + 16 * z * z * z + 3 * z) / (96 * v * v) +
           (3 * std::pow(z, 7) + 19 * std::pow(z, 5) + 17 * z * z * z - 15 * z) / (384 * v * v * v);
}

/// Returns the largest probability of an event that none of `trials` independent trials shows, in any of n
/// comparisons, at the level of criticalZ. A mean may be wrong by as much where such an event changes a value
/// by 1, whatever the standard error that the trials show.
inline double unseenProbability(size_t n, double trials) { return std::log(1e4 * double(n)) / trials; }

} // namespace strobe::test
