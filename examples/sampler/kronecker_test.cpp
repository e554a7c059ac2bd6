// Tests the sampler kronecker: kronecker_test kronecker.so
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

/// A tilted edge between black and white: an emitting triangle.
SceneModel edge(const PluginsPtr& plugins, const std::string& sampler) {
    SceneModel scene(plugins);
    scene.setCamera("orthographic", {}, lookAt({0, 0, 1}, {0, 0, 0}, {0, 1, 0}));
    scene.setSampler(sampler);
    TriangleMesh mesh;
    mesh.indices = {0, 1, 2};
    mesh.positions = {{{-3, -2, 0}, {3, 1.7f, 0}, {-3, 9, 0}}};
    ShapeSettings light;
    light.emission = PluginParams{{"L", Rgb(1)}, {"twosided", true}};
    scene.addMesh(mesh, light);
    return scene;
}

/// Returns the pixels of the picture, by seed.
std::vector<float> render(const PluginsPtr& plugins, const std::string& sampler, int samples, uint64_t seed) {
    PictureSettings settings;
    settings.samplesPerPixel = samples;
    settings.resolution = V2i(32, 32);
    settings.seed = seed;
    std::vector<float> values;
    for (const Rgb& pixel : renderPicture(edge(plugins, sampler), settings).image.pixels)
        values.push_back(pixel.y);
    return values;
}

/// Returns the mean squared error of the pixels, and adds the mean of all to `total`.
double error(const PluginsPtr& plugins, const std::string& sampler, const std::vector<float>& reference,
             double& total) {
    constexpr int kSeeds = 8;
    double sum = 0;
    total = 0;
    for (uint64_t seed = 0; seed < kSeeds; ++seed) {
        const std::vector<float> values = render(plugins, sampler, 64, seed);
        for (size_t i = 0; i < values.size(); ++i) {
            const double difference = double(values[i]) - double(reference[i]);
            sum += difference * difference;
            total += double(values[i]);
        }
    }
    total /= kSeeds * double(reference.size());
    return sum / (kSeeds * double(reference.size()));
}

} // namespace

int main(int, char** argv) {
    const PluginsPtr plugins = loadPlugins({argv[1]});
    const std::vector<float> reference = render(plugins, "sobol", 4096, 99);
    double independentTotal, kroneckerTotal;
    const double independent = error(plugins, "independent", reference, independentTotal);
    const double kronecker = error(plugins, "kronecker", reference, kroneckerTotal);
    expect(kronecker < independent / 4, "a quarter of the error of independent samples at an edge");
    expect(std::abs(kroneckerTotal - independentTotal) < 1e-3, "the same mean");
    expect(render(plugins, "kronecker", 4, 1) != render(plugins, "kronecker", 4, 2), "seeds differ");
    return failures == 0 ? 0 : 1;
}
