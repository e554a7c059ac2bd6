// Tests the material lunar against closed forms: lunar_test lunar.so
#include <strobe/strobe.h>

#include <cmath>
#include <cstdio>

using namespace strobe;

namespace {

int failures = 0;

void expectNear(double value, double expected, double tolerance, const char* what) {
    if (!(std::abs(value - expected) <= tolerance)) {
        std::printf("FAILED: %s: %.5f, expected %.5f +- %.5f\n", what, value, expected, tolerance);
        ++failures;
    }
}

/// Returns the mean of the picture of a disk that fills the image, seen at an angle.
double radiance(const PluginsPtr& plugins, float cosOut, bool isFurnace, const char* integrator) {
    SceneModel scene(plugins);
    const V3f eye(std::sqrt(1 - cosOut * cosOut) * 50, 0, cosOut * 50);
    scene.setCamera("orthographic", {}, lookAt(eye, {0, 0, 0}, {0, 1, 0}));
    scene.setShading("path", {{"maxdepth", 1}});
    if (isFurnace)
        scene.addLight("infinite", {{"L", Rgb(1)}});
    else // light along the normal
        scene.addLight("distant", {{"from", V3f(0, 0, 1)}, {"to", V3f(0, 0, 0)}, {"L", Rgb(1)}});
    ShapeSettings disk;
    disk.material = scene.addMaterial("lunar", {{"albedo", Rgb(.8f)}});
    scene.addShape("disk", {{"radius", 100.f}}, disk);
    PictureSettings settings;
    settings.integrator = integrator;
    settings.samplesPerPixel = 1024;
    settings.resolution = V2i(8, 8);
    const Picture picture = renderPicture(scene, settings);
    double sum = 0;
    for (const Rgb& pixel : picture.image.pixels)
        sum += double(pixel.y);
    return sum / double(picture.image.pixels.size());
}

/// Returns the fraction of uniform light that the surface reflects towards an angle.
double reflectance(double albedo, double cosOut) {
    return albedo / 2 * (1 - cosOut * std::log((1 + cosOut) / cosOut));
}

} // namespace

int main(int, char** argv) {
    const PluginsPtr plugins = loadPlugins({argv[1]});
    // Noise: msaa has a shade for each pixel.
    for (const auto& [integrator, noise] :
         {std::pair("supersample", 2e-3), {"msaa", 2e-2}, {"adaptive-cache", 2e-3}})
        for (const float cosOut : {1.f, .5f, .1f}) {
            expectNear(radiance(plugins, cosOut, true, integrator), reflectance(.8, double(cosOut)), noise,
                       "reflectance under a white sky");
            expectNear(radiance(plugins, cosOut, false, integrator), .8 / (4 * M_PI * (1 + double(cosOut))),
                       1e-5, "radiance under light along the normal");
        }
    return failures == 0 ? 0 : 1;
}
