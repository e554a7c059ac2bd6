// Tests the integrator quad: quad_test quad.so
#include <strobe/strobe.h>

#include <cmath>
#include <cstdio>

using namespace strobe;

namespace {

int failures = 0;

void expect(bool condition, const char* what) {
    if (!condition) {
        std::printf("FAILED: %s\n", what);
        ++failures;
    }
}

constexpr int kSize = 16; ///< pixels

/// A wall that fills the image, lit from a corner: radiance varies from pixel to pixel.
SceneModel wall(const PluginsPtr& plugins) {
    SceneModel scene(plugins);
    scene.setCamera("perspective", {{"fov", 40.0}}, lookAt({0, 0, 4}, {0, 0, 0}, {0, 1, 0}));
    scene.setShading("directlighting");
    scene.addLight("point", {{"from", V3f(3, 3, 1)}, {"I", Rgb(50)}});
    scene.addShape("disk", {{"radius", 100.f}});
    return scene;
}

PictureSettings settingsOf(const std::string& integrator, uint64_t seed) {
    PictureSettings settings;
    settings.integrator = integrator;
    settings.samplesPerPixel = 4;
    settings.resolution = V2i(kSize, kSize);
    settings.seed = seed;
    return settings;
}

void testShadesOncePerSquare(const PluginsPtr& plugins) {
    const Picture picture = renderPicture(wall(plugins), settingsOf("quad", 0));
    expect(picture.stats.total.visibilitySamples == 4 * kSize * kSize, "four samples per pixel");
    expect(picture.stats.total.shades == kSize * kSize / 4, "one shade per square of 2x2 pixels");
    for (int y = 0; y < kSize; y += 2)
        for (int x = 0; x < kSize; x += 2) {
            expect(picture.image.at(x, y) == picture.image.at(x + 1, y + 1), "the pixels of a square share");
            expect(picture.image.at(x, y) != picture.image.at((x + 2) % kSize, y), "squares do not share");
        }
}

/// The mean of each pixel over many seeds, and its standard error.
struct Means {
    static constexpr int kSeeds = 64;
    double sum[kSize][kSize] = {}, squares[kSize][kSize] = {};

    Means(const SceneModel& scene, const std::string& integrator, uint64_t firstSeed) {
        for (int seed = 0; seed < kSeeds; ++seed) {
            const Picture picture = renderPicture(scene, settingsOf(integrator, firstSeed + uint64_t(seed)));
            for (int y = 0; y < kSize; ++y)
                for (int x = 0; x < kSize; ++x) {
                    const double value = double(picture.image.at(x, y).y);
                    sum[y][x] += value;
                    squares[y][x] += value * value;
                }
        }
    }
    double mean(int x, int y) const { return sum[y][x] / kSeeds; }
    double error(int x, int y) const {
        const double variance = squares[y][x] / kSeeds - mean(x, y) * mean(x, y);
        return std::sqrt(std::max(variance, 0.) / (kSeeds - 1));
    }
};

/// The bound is the diagonal of a square: less than 3 pixels.
void testTheMeanIsWithinTheBiasBound(const PluginsPtr& plugins) {
    constexpr int kReach = 3;
    constexpr double kStandardErrors = 5; // of 256 pixels, one exceeds it with a probability of 1e-4
    const SceneModel scene = wall(plugins);
    const Means exact(scene, "supersample", 100), shared(scene, "quad", 900);
    for (int y = kReach; y < kSize - kReach; ++y)
        for (int x = kReach; x < kSize - kReach; ++x) {
            double low = exact.mean(x, y), high = low;
            for (int v = y - kReach; v <= y + kReach; ++v)
                for (int u = x - kReach; u <= x + kReach; ++u) {
                    low = std::min(low, exact.mean(u, v));
                    high = std::max(high, exact.mean(u, v));
                }
            const double noise = kStandardErrors * std::hypot(exact.error(x, y), shared.error(x, y));
            expect(shared.mean(x, y) > low - noise && shared.mean(x, y) < high + noise,
                   "the mean lies in the range of the exact ones within the reach");
        }
}

void testASizeBelowOneIsAnError(const PluginsPtr& plugins) {
    PictureSettings settings = settingsOf("quad", 0);
    settings.defines = {"size=0"};
    try {
        renderPicture(wall(plugins), settings);
        expect(false, "size=0 is an error");
    } catch (const Error& e) {
        expect(std::string(e.what()) == "-D size: must be at least 1", e.what());
    }
}

} // namespace

int main(int, char** argv) {
    const PluginsPtr plugins = loadPlugins({argv[1]});
    testShadesOncePerSquare(plugins);
    testTheMeanIsWithinTheBiasBound(plugins);
    testASizeBelowOneIsAnError(plugins);
    return failures == 0 ? 0 : 1;
}
