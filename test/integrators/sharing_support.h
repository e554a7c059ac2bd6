// Helpers of the integrators' tests.
#pragma once

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

} // namespace strobe::test
