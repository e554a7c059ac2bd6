// The depths of pbrt's integrators.
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

/// Returns the mean of a picture from inside a sphere that emits 1 and reflects .5.
double meanInFurnace(const std::string& integrator, const BuildOptions& options = {}) {
    const std::string text = integrator + R"(
Film "image" "integer xresolution" 16 "integer yresolution" 16
Sampler "sobol" "integer pixelsamples" 64
Camera "perspective"
WorldBegin
Material "matte" "rgb Kd" [.5 .5 .5]
AreaLightSource "diffuse" "rgb L" [1 1 1]
ReverseOrientation
Shape "sphere" )";
    Diagnostics diagnostics([](const std::string&) {});
    const Image image = test::render(buildScene(parseText(text, "test.pbrt", {"supersample"}, diagnostics),
                                                options, diagnostics))
                            .image;
    double sum = 0;
    for (const Rgb& pixel : image.pixels)
        sum += double(luminance(pixel));
    return sum / double(image.pixels.size());
}

/// pbrt-v2 ends a path after maxdepth + 1 vertices, v3 and v4 after maxdepth.
TEST(CompatIntegrators, PathsOfVersion2HaveOneMoreVertex) {
    double sum = 1;
    for (int depth = 0; depth <= 3; ++depth) {
        const std::string maxDepth = "\"path\" \"integer maxdepth\" " + std::to_string(depth);
        EXPECT_NEAR(meanInFurnace("Integrator " + maxDepth), sum, .005 * sum) << depth;
        sum += std::pow(.5, depth + 1);
        EXPECT_NEAR(meanInFurnace("SurfaceIntegrator " + maxDepth), sum, .005 * sum) << depth;
    }
    EXPECT_NEAR(meanInFurnace("Integrator \"path\""), 2 - std::pow(.5, 5), .01);
    EXPECT_NEAR(meanInFurnace("SurfaceIntegrator \"path\""), 2 - std::pow(.5, 6), .01);
}

TEST(CompatIntegrators, DirectLightingHasDirectLightWithDepth0) {
    for (const char* integrator :
         {"Integrator \"directlighting\"", "Integrator \"whitted\"", "SurfaceIntegrator \"directlighting\""})
        for (const char* depth : {"0", "1", "3"})
            EXPECT_NEAR(meanInFurnace(std::string(integrator) + " \"integer maxdepth\" " + depth), 1.5, .005)
                << integrator << depth;
}

TEST(CompatIntegrators, OptionsCountVertices) {
    BuildOptions options;
    options.defines = {"maxdepth=1"};
    EXPECT_NEAR(meanInFurnace("SurfaceIntegrator \"path\"", options), 1.5, .005);
    options.defines = {"maxdepth=0"};
    EXPECT_NEAR(meanInFurnace("SurfaceIntegrator \"directlighting\"", options), 1, .005);
}

} // namespace
} // namespace strobe
