// SceneDescription to Scene: makes every plugin, places every shape, fits every motion.
#pragma once

#include "core/film.h"
#include "core/integrator.h"
#include "scene/description.h"
#include "scene/plugins.h"

#include <optional>

namespace strobe {

/// What the command line changes of what the scene says.
struct BuildOptions {
    std::string integrator;           ///< empty: as the scene says
    std::vector<std::string> defines; ///< name=value for the integrator or the shading
    std::string shading;              ///< likewise
    int samplesPerPixel = 0;          ///< 0: as the scene says
    std::optional<V2i> resolution;
    std::optional<std::array<float, 4>> crop; ///< x0 x1 y0 y1, fractions
    std::optional<float> frameTime;           ///< a still at this scene time
    bool quick = false;                       ///< a quarter of the resolution and of the samples
};

/// Everything that render() needs, ready.
struct BuiltScene {
    std::unique_ptr<const Scene> scene;
    SamplerSetup sampler;
    std::shared_ptr<const Filter> filter;
    std::shared_ptr<const Shader> shader;
    std::shared_ptr<const Integrator> integrator;
    V2i resolution;
    Window window;
    std::vector<std::string> materialNames; ///< of the scene's materials, for people
    std::string filename;                   ///< the scene's own output name
    Metadata metadata; ///< integrator and shading with all their parameters, sampler, filter
};

/// Consumes the description (meshes are moved out of it). Throws located Errors; warns through `messages`.
BuiltScene buildScene(SceneDescription&& description, const BuildOptions& options, Messages& messages);

} // namespace strobe
