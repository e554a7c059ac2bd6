// A scene in a temporary folder, and a log that collects messages.
#pragma once

#include "core/image/image.h"
#include "session/session.h"
#include "support/scene_text.h"

#include <algorithm>

namespace strobe::test {

class SessionTest : public testing::Test {
  protected:
    SessionTest() {
        options.scenes = {m_folder.write("ball.scene", R"(
TransformTimes 0 1
Film "image" "integer xresolution" 24 "integer yresolution" 16
Sampler "sobol" "integer pixelsamples" 8
Integrator "directlighting"
Camera "perspective" "float fov" 60
WorldBegin
LightSource "infinite" "rgb L" [.2 .3 .4]
LightSource "point" "point3 from" [2 3 0] "rgb I" [20 20 20]
Material "matte" "rgb Kd" [.6 .5 .4]
Translate -.6 0 4
ActiveTransform EndTime
Translate 1.2 0 0
ActiveTransform All
Shape "sphere" "float radius" .8
)")};
        options.threads = 1;
        options.tileSize = 4;
        log.sink = [this](LogLevel level, const std::string& text) { messages.emplace_back(level, text); };
    }

    /// Renders a corner with a mirror and a lamp by adaptive-cache, which shares indirect light.
    void useAdaptiveCache() {
        options.scenes = {m_folder.write("corner.scene", R"(
Film "image" "integer xresolution" 24 "integer yresolution" 16
Sampler "sobol" "integer pixelsamples" 8
Integrator "path"
LookAt 0 2 -6  0 1.2 0  0 1 0
Camera "perspective" "float fov" 50
WorldBegin
LightSource "point" "point3 from" [1 4 -3] "rgb I" [40 40 40]
Material "matte" "rgb Kd" [.8 .7 .5]
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-9 0 2  9 0 2  9 9 2  -9 9 2]
Material "mirror"
Translate 1.2 .8 .5
Shape "sphere" "float radius" .7
AreaLightSource "diffuse" "rgb L" [40 40 40]
Translate -2.5 1 0
Shape "sphere" "float radius" .2
)")};
        options.build.integrator = "adaptive-cache";
        options.build.defines = {"share=indirect"};
    }

    std::filesystem::path path(const std::string& name) const { return m_folder.path() / name; }
    bool exists(const std::string& name) const { return std::filesystem::exists(path(name)); }

    /// The options with these files as images.
    RenderOptions writing(std::initializer_list<const char*> names) const {
        RenderOptions o = options;
        for (const char* name : names)
            o.output.images.push_back(path(name));
        return o;
    }

    std::vector<Rgb> pixels(const std::string& name) const { return readImage(path(name), {}).pixels; }
    std::string attribute(const std::string& name, const std::string& attribute) const {
        return readMetadata(path(name), attribute);
    }
    bool hasMessage(LogLevel level, const std::string& text) const {
        return std::any_of(messages.begin(), messages.end(), [&](const auto& message) {
            return message.first == level && message.second.find(text) != std::string::npos;
        });
    }

    /// Callbacks that call `action` once, when more than half of an image is rendered.
    RenderCallbacks atHalf(RenderControl& control, std::function<void()> action) const {
        RenderCallbacks callbacks;
        callbacks.control = &control;
        callbacks.onProgress = [action = std::move(action), isDone = false](double fraction) mutable {
            if (fraction > 0.5 && !isDone) {
                isDone = true;
                action();
            }
        };
        return callbacks;
    }

    RenderOptions options; ///< of the scene, without outputs
    Log log;
    std::vector<std::pair<LogLevel, std::string>> messages;

  private:
    TemporaryFolder m_folder;
};

/// Returns the text of the Error of kind Usage that `run` throws; empty if it throws none.
template <class Run>
std::string usageError(const Run& run) {
    try {
        run();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind, ErrorKind::Usage) << e.what();
        return e.what();
    }
    return "";
}

} // namespace strobe::test
