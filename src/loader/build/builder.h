// Builds scenes from descriptions: creates all plugins, places shapes and fits motion to the shutter.
#pragma once

#include "core/film/film.h"
#include "core/math/api.h"
#include "core/render/integrator.h"
#include "core/render/shader.h"
#include "core/util/diagnostics.h"
#include "loader/build/plugin_tables.h"
#include "loader/parser/description.h"

#include <optional>

namespace STROBE_API strobe {

/// Settings of the command line that override the scene's.
struct BuildOptions {
    std::string integrator;                   ///< empty: the scene's
    std::string shading;                      ///< empty: the scene's
    std::vector<std::string> defines;         ///< name=value: parameters of the integrator or the shader
    int samplesPerPixel = 0;                  ///< 0: the scene's
    std::optional<V2i> resolution;            ///< pixels
    std::optional<std::array<float, 4>> crop; ///< x0 x1 y0 y1, in fractions of the frame
    std::optional<PixelBounds> pixelBounds;   ///< overrides crop; must lie in the frame
    std::optional<Shutter> shutter; ///< in scene time; overrides the camera's; open == close: an instant
    bool quick = false;             ///< a quarter of the width, the height and the samples
    bool transparent = false;       ///< see Scene::showsBackground
    int textureMegabytes = 0;       ///< see TextureCache; 0: its default
    std::shared_ptr<const ColorConfig> color = std::make_shared<const ColorConfig>();
    std::string gltfAnimation,
        gltfCamera;              ///< for glTF files whose Shape "gltf" names none; empty: the default
    bool gltfPhotometric = true; ///< see gltf::Settings
    bool gltfCulling = false;    ///< see gltf::Settings
    float gltfPointRadius = 0;   ///< for files whose Shape names none; see gltf::Settings
    bool gltfGround = false;     ///< adds a matte floor below the glTF files
    std::shared_ptr<const PluginLibraries> plugins = std::make_shared<const PluginLibraries>();
};

/// The properties that all frames of a scene have in common.
struct FrameSetup {
    SamplerSetup sampler;
    std::shared_ptr<const Filter> filter;
    std::shared_ptr<const Shader> shader;
    std::shared_ptr<const Integrator> integrator;
    V2i resolution;
    PixelBounds pixelBounds;
    std::vector<std::string> materialNames;            ///< by material, with file and line, for messages
    std::vector<std::string> cryptomatteMaterialNames; ///< by material; see cryptomatteNames
    std::vector<std::string> lightGroups;              ///< names, indexed by Light::group
    std::shared_ptr<const TextureCache> textures;      ///< of the images
    std::string filename;                              ///< output file that the scene names; may be empty
    bool isLitByGltf = false; ///< lights of glTF files are the only ones, besides emission
    Metadata metadata; ///< names and parameters of the integrator and the shader, names of sampler and filter
};

/// A scene that is ready to render.
struct BuiltScene : FrameSetup {
    std::unique_ptr<const Scene> scene;
};

/// Builds the frames of one description. Plugins that do not depend on the shutter are created once. Throws
/// located Errors.
class SceneBuilder {
  public:
    /// The number of frames to build. With One, memory is released during the build.
    enum class Frames { One, Many };
    /// `diagnostics` must outlive the builder.
    SceneBuilder(SceneDescription&& description, const BuildOptions& options, Diagnostics& diagnostics,
                 Frames frames = Frames::Many);
    ~SceneBuilder();
    const FrameSetup& setup() const;
    /// Builds the frame of a shutter, in scene time. The result may outlive the builder.
    BuiltScene build(const Shutter& shutter);
    /// Builds the frame of the options' shutter, or else of the scene's camera.
    BuiltScene build();

  private:
    class Impl;
    std::unique_ptr<Impl> m_impl;
};

/// Builds the frame of the options' shutter, or else of the scene's camera. Consumes the description, whose
/// meshes are moved. Throws located Errors.
BuiltScene buildScene(SceneDescription&& description, const BuildOptions& options, Diagnostics& diagnostics);

} // namespace strobe
