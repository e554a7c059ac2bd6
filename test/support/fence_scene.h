// A scene whose only noise is that of thin bars before a lit floor.
#pragma once

#include <string>

namespace strobe::test {

/// A floor in uniform light, and a fence of thin bars before it, right of the middle of 128x64 pixels.
/// `lamp`: shapes that are added to the world; black where they do not emit.
inline std::string fenceScene(int samples, int bars = 4, const std::string& lamp = "") {
    std::string text = R"(
Film "image" "integer xresolution" 128 "integer yresolution" 64
Sampler "sobol" "integer pixelsamples" )" +
                       std::to_string(samples) + R"(
Integrator "directlighting"
Camera "orthographic" "float screenwindow" [-2 2 -1 1]
WorldBegin
LightSource "distant" "point3 from" [0 0 -1] "point3 to" [0 0 0] "rgb L" [1 1 1]
Material "matte" "rgb Kd" [.5 .5 .5]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-9 -9 5  9 -9 5  9 9 5  -9 9 5]
Material "matte" "rgb Kd" [0 0 0]
)" + lamp;
    for (int i = 0; i < bars; ++i) {
        const std::string x = std::to_string(0.05 + 0.1 * i), y = std::to_string(0.08 + 0.1 * i);
        text += "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [" + x + " -9 2 " + y +
                " -9 2 " + y + " 9 2 " + x + " 9 2]\n";
    }
    return text;
}

} // namespace strobe::test
