// Scenes seen straight from the front, one of which has the noise of thin bars only.
#pragma once

#include <string>

namespace strobe::test {

/// A scene of 128x64 pixels: an orthographic view along z of x in [-2,2] and y in [-1,1].
inline std::string frontView(int samples, const std::string& world,
                             const std::string& shading = "directlighting") {
    return R"(
Film "image" "integer xresolution" 128 "integer yresolution" 64
Sampler "sobol" "integer pixelsamples" )" +
           std::to_string(samples) + "\nIntegrator \"" + shading + R"("
Camera "orthographic" "float screenwindow" [-2 2 -1 1]
WorldBegin
)" + world;
}

/// A floor in uniform light, and a fence of thin bars before it, right of the middle of frontView.
/// `lamp`: shapes that are added to the world; black where they do not emit.
inline std::string fenceScene(int samples, int bars = 4, const std::string& lamp = "") {
    std::string world = R"(
LightSource "distant" "point3 from" [0 0 -1] "point3 to" [0 0 0] "rgb L" [1 1 1]
Material "matte" "rgb Kd" [.5 .5 .5]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-9 -9 5  9 -9 5  9 9 5  -9 9 5]
Material "matte" "rgb Kd" [0 0 0]
)" + lamp;
    for (int i = 0; i < bars; ++i) {
        const std::string x = std::to_string(0.05 + 0.1 * i), y = std::to_string(0.08 + 0.1 * i);
        world += "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [" + x + " -9 2 " +
                 y + " -9 2 " + y + " 9 2 " + x + " 9 2]\n";
    }
    return frontView(samples, world);
}

} // namespace strobe::test
