// Renders of scenes in memory.
#pragma once

#include "api/scene_model.h"
#include "core/film/aov.h"
#include "core/image/image.h"
#include "core/render/render_settings.h"

namespace STROBE_API strobe {

/// The settings of a render. The defaults are those of the program strobe.
struct PictureSettings {
    std::string integrator;                 ///< empty: the scene's, or the default
    std::string shading;                    ///< empty: the scene's, or the default
    std::vector<std::string> defines;       ///< name=value: parameters of the integrator and the shading
    int samplesPerPixel = 0;                ///< 0: the scene's
    std::optional<V2i> resolution;          ///< pixels; none: the scene's, or 640x480
    std::optional<PixelBounds> pixelBounds; ///< none: the whole frame
    std::optional<Shutter> shutter;         ///< in scene time; none: the camera's
    std::vector<std::string> aovs;          ///< names of layers: docs/layers.md
    bool transparent = false;               ///< the background is not shown
    uint64_t seed = 0;
    float clamp = 0; ///< see RenderSettings::clamp
    int threads = 0; ///< 0: one per core

    /// Receives the fraction done, in [0, 1]. Called by any thread, by one at a time.
    std::function<void(double)> onProgress;
    /// Once it returns true, the render ends early. Called by any thread, often.
    std::function<bool()> isCancelled;
    /// Receives warnings.
    std::function<void(const std::string&)> onWarning;
};

/// The result of a render.
struct Picture {
    Image image;                    ///< linear radiance of the pixel bounds, row by row from the top
    V2i resolution;                 ///< of the frame
    PixelBounds pixelBounds;        ///< in the frame
    std::vector<AovChannel> layers; ///< channels of the AOVs, with the pixels of the image
    RenderStats stats;
    bool isFinished = true; ///< false: it was cancelled; the image has some of the samples

    /// Returns the values of a channel, such as "depth", "Z"; null if there is none.
    const std::vector<float>* layer(const std::string& layer, const std::string& channel) const;
};

/// Renders a scene. Several threads may render at the same time. The image has the bits of the program's
/// output before it is rounded to the format of a file. Throws Error.
Picture renderPicture(SceneModel scene, const PictureSettings& settings = {});

/// Writes an image to a file; its extension gives the format, as in the program strobe. Throws Error of kind
/// Output.
void writePicture(const Picture& picture, const std::filesystem::path& file);

} // namespace strobe
