// glTF files in a SceneDescription: converts the results of gltf/import.h to declarations.
#pragma once

#include "core/util/diagnostics.h"
#include "gltf/view.h"
#include "loader/build/plugin_tables.h"
#include "loader/parser/description.h"

namespace strobe {

/// The shutter, in seconds, of a scene with glTF files and without Camera: an instant, so that stills are
/// sharp.
inline constexpr Shutter kGltfShutter{0, 0};

/// The glTF files of a description. Scene time is the files' time, in seconds.
class GltfScene {
  public:
    /// Appends everything that does not depend on the shutter to the description. If there is no light but
    /// emission of the files, adds the light "studio". `hasGround`: adds a matte floor below the files.
    /// Throws Errors located at the references to the files.
    GltfScene(SceneDescription& description, TextureCache& textures, bool hasGround,
              Diagnostics& diagnostics);
    ~GltfScene();

    /// Returns true if lights of the files are the only ones, besides emission.
    bool isLitByFiles() const { return m_isLitByFiles; }
    /// Returns true if the scene has glTF files and no Camera: `camera` is used then.
    bool givesCamera() const { return m_givesCamera; }
    /// Returns the film of a scene without Film, in the aspect ratio of the camera.
    Statement film() const;
    /// Returns the camera of the first file that has one, or else a camera that sees all files.
    Statement camera(const V2i& resolution);

    /// Appends everything that moves or deforms while the shutter is open to the description, and updates
    /// moving lights and the camera.
    void beginFrame(SceneDescription& description, const Shutter& shutter);
    /// Removes the declarations that beginFrame appended.
    void endFrame(SceneDescription& description);
    /// Returns the indices into SceneDescription::lights of the lights that beginFrame updates.
    const std::vector<size_t>& movingLights() const { return m_movingLights; }

  private:
    class File;

    std::vector<std::unique_ptr<File>> m_files;
    const File* m_cameraFile = nullptr; ///< null: a default view
    bool m_givesCamera = false;
    bool m_isLitByFiles = false;
    std::vector<V3f> m_extremes; ///< of all files, in the world
    V2f m_halfView{1};           ///< of the default view: tangents of half its angles
    std::vector<size_t> m_movingLights;
    size_t m_staticObjects = 0; ///< number of objects before beginFrame
    std::vector<size_t>
        m_staticInstances; ///< numbers of instances before beginFrame: of the world, of each object
};

} // namespace strobe
