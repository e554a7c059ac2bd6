// Helpers of the integrators' tests.
#pragma once

#include "core/render/render.h"
#include "support/render_text.h"

#include <cstring>

namespace strobe::test {

inline BuiltScene buildWith(const std::string& integrator, const std::string& text,
                            std::vector<std::string> defines = {}) {
    BuildOptions options;
    options.integrator = integrator;
    options.defines = std::move(defines);
    return build(text, options);
}

inline bool haveEqualBits(const Image& a, const Image& b) {
    return a.width == b.width && a.height == b.height &&
           !std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb));
}

/// Whether `crop` is the part of `image` whose top left corner is (x0, y0).
inline bool isCropOf(const Image& crop, const Image& image, int x0, int y0) {
    for (int y = 0; y < crop.height; ++y)
        if (std::memcmp(&crop.at(0, y), &image.at(x0, y0 + y), sizeof(Rgb) * size_t(crop.width)) != 0)
            return false;
    return true;
}

/// Returns the mean squared difference of pixels cut at 1.
inline double clippedError(const Image& image, const Image& reference) {
    double sum = 0;
    for (size_t i = 0; i < image.pixels.size(); ++i)
        for (int c = 0; c < 3; ++c)
            sum += sqr(double(std::min(image.pixels[i][c], 1.f)) - std::min(reference.pixels[i][c], 1.f));
    return sum / double(3 * image.pixels.size());
}

/// Returns a frame of direct light in which each sample chooses one lamp, before the camera.
inline std::string oneLampFrame(int samples) {
    return R"(
Film "image" "integer xresolution" 96 "integer yresolution" 72
Sampler "sobol" "integer pixelsamples" )" +
           std::to_string(samples) + "\nIntegrator \"directlighting\" \"string strategy\" \"one\"\n";
}

/// Returns a frame and a world with a lamp that the camera sees, under a faint sky.
inline std::string lampFrame(int width, int height, int samples, const std::string& shading) {
    return "Film \"image\" \"integer xresolution\" " + std::to_string(width) + " \"integer yresolution\" " +
           std::to_string(height) + "\nSampler \"sobol\" \"integer pixelsamples\" " +
           std::to_string(samples) + "\nIntegrator \"" + shading + R"("
LookAt 0 2 -6  0 1.2 0  0 1 0
Camera "perspective" "float fov" 50
WorldBegin
LightSource "infinite" "rgb L" [.1 .12 .15]
AttributeBegin
  Translate 1.2 2.6 0
  AreaLightSource "diffuse" "rgb L" [40 40 40]
  Shape "sphere" "float radius" .2
AttributeEnd
)";
}

/// Returns the mean squared difference of the means of pixels, minus its expected value for equal means.
inline double squaredBias(const PixelStatistics& biased, const PixelStatistics& reference) {
    double sum = 0;
    for (size_t i = 0; i < reference.mean.size(); ++i) {
        const double difference = biased.mean[i] - reference.mean[i];
        sum += difference * difference - biased.error[i] * biased.error[i] -
               reference.error[i] * reference.error[i];
    }
    return sum / double(reference.mean.size());
}

/// Renders slices of the samples that end at `ends`, each with other tiles, into one film.
inline Film renderInSlices(const BuiltScene& built, const std::vector<uint32_t>& ends) {
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds);
    film.enableAccumulation();
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    uint32_t first = 0;
    for (const uint32_t end : ends) {
        settings.slice = SampleSlice{first, end};
        settings.tileSize = int(5 + end);
        Renderer renderer(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                          *built.filter, settings, built.pixelBounds);
        renderer.render(film);
        if (end == ends.back())
            renderer.finish(film);
        first = end;
    }
    return film;
}

/// The image of a film's samples, and that which the integrator completes from the records.
struct MergedImages {
    Image incomplete, completed;
};

/// Merges a film into an empty one, and completes this as `strobe merge` does.
inline MergedImages mergeFilm(const BuiltScene& built, const Film& film) {
    Film merged(film.fullWidth(), film.fullHeight(), film.pixelBounds());
    merged.enableAccumulation();
    merged.merge(film);
    MergedImages images{merged.image(), {}};
    built.integrator->finishMerged(merged);
    images.completed = merged.image();
    return images;
}

/// Renders passes of the scene's samples per pixel each.
inline Image renderInPasses(const BuiltScene& built, int passes, int tileSize = 32) {
    RenderSettings settings;
    settings.tileSize = tileSize;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.isPass = true;
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds), pass = film;
    film.enableAccumulation();
    pass.enableAccumulation();
    Renderer renderer(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
                      settings, built.pixelBounds);
    for (int i = 0; i < passes; ++i) {
        if (i > 0)
            renderer.restart(uint64_t(i), settings.samplesPerPixel, renderer.stats().samplesPerPixel);
        pass.clear();
        renderer.render(pass);
        film.merge(pass);
        built.integrator->mergeRecords(film.records());
    }
    renderer.finish(film);
    return film.image();
}

/// A closed sphere that emits and reflects a half each: the radiance is 1 everywhere.
inline const std::string kFurnace = R"(
Film "image" "integer xresolution" 12 "integer yresolution" 12
Sampler "sobol" "integer pixelsamples" 16
Integrator "path" "integer maxdepth" 200
Camera "perspective" "float fov" 90
WorldBegin
ReverseOrientation
AreaLightSource "diffuse" "rgb L" [.5 .5 .5]
Material "matte" "rgb Kd" [.5 .5 .5]
Translate .3 .2 0
Shape "sphere" "float radius" 1
)";

/// A diffuse floor, a textured wall, a moving glossy ball and a mirror ball.
inline const std::string kCorner = R"(
Material "matte" "rgb Kd" [.8 .7 .5]
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
Texture "c" "rgb" "checkerboard" "rgb tex1" [.2 .3 .2] "rgb tex2" [.9 .8 .7]
Material "matte" "texture Kd" "c"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3]
  "point P" [-9 0 2  9 0 2  9 9 2  -9 9 2] "point2 uv" [0 0 16 0 16 8 0 8]
AttributeBegin
  Material "plastic" "float roughness" .1
  Translate -1.2 1 0
  ActiveTransform EndTime
  Translate .5 0 0
  ActiveTransform All
  Shape "sphere" "float radius" .7
AttributeEnd
AttributeBegin
  Material "mirror"
  Translate 1.2 .8 .5
  Shape "sphere" "float radius" .7
AttributeEnd
)";

} // namespace strobe::test
