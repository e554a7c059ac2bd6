// SceneDescription to Scene: makes every plugin, places every shape, fits every motion.
#pragma once

#include "core/film/film.h"
#include "core/render/integrator.h"
#include "core/render/shader.h"
#include "loader/build/plugin_tables.h"
#include "loader/parser/description.h"

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
    std::optional<PixelBounds> pixelBounds;   ///< goes before crop; must lie in the frame
    std::optional<Shutter> shutter; ///< in scene time, in place of the camera's; closing as it opens: a still
    bool quick = false;             ///< a quarter of the resolution and of the samples
    std::shared_ptr<const ColorConfig> color = std::make_shared<const ColorConfig>();
    std::string gltfAnimation, gltfCamera; ///< of glTF files that the scene leaves the choice; empty: theirs
};

/// What all frames of a scene have in common.
struct FrameSetup {
    SamplerSetup sampler;
    std::shared_ptr<const Filter> filter;
    std::shared_ptr<const Shader> shader;
    std::shared_ptr<const Integrator> integrator;
    V2i resolution;
    PixelBounds pixelBounds;
    std::vector<std::string> materialNames;            ///< of the scene's materials, for people
    std::vector<std::string> cryptomatteMaterialNames; ///< the same for Cryptomatte: without places in files
    std::vector<std::string> lightGroups;              ///< by Light::group
    std::string filename;                              ///< the scene's own output name
    Metadata metadata; ///< integrator and shading with all their parameters, sampler, filter
};

/// Everything that render() needs, ready.
struct BuiltScene : FrameSetup {
    std::unique_ptr<const Scene> scene;
};

/// Builds frames from one description: what does not depend on the shutter is made once. Throws located
/// Errors; warns through `messages`, which must outlive it.
class SceneBuilder {
  public:
    /// How many frames are to be built: for one alone, memory is given back as soon as it may be.
    enum class Frames { One, Many };
    SceneBuilder(SceneDescription&& description, const BuildOptions& options, Diagnostics& messages,
                 Frames frames = Frames::Many);
    ~SceneBuilder();
    const FrameSetup& setup() const;
    /// The scene while `shutter` (in scene time) is open. Scenes outlive the builder and one another.
    BuiltScene build(const Shutter& shutter);
    /// With the shutter of the options, or else of the scene's camera.
    BuiltScene build();

  private:
    class Impl;
    std::unique_ptr<Impl> m_impl;
};

/// Builds the one frame of the scene's own shutter. Consumes the description (meshes are moved out of it).
BuiltScene buildScene(SceneDescription&& description, const BuildOptions& options, Diagnostics& messages);

} // namespace strobe
