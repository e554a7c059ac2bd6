// glTF files in a SceneDescription: converts the results of gltf/import.h to declarations.
#pragma once

#include "core/util/diagnostics.h"
#include "loader/build/plugin_tables.h"
#include "loader/parser/description.h"

namespace strobe {

/// The shutter, in seconds, of a scene with glTF files and without Camera: half a frame at 24 frames per
/// second.
inline constexpr Shutter kGltfShutter{0, 1.f / 48};

/// The glTF files of a description. Scene time is the files' time, in seconds.
class GltfScene {
  public:
    /// Appends everything that does not depend on the shutter to the description. If nothing lights the
    /// scene, adds a sky and a sun. Throws Errors located at the references to the files.
    GltfScene(SceneDescription& description, TextureCache& textures, Diagnostics& diagnostics);
    ~GltfScene();

    /// Returns true if the scene has glTF files and no Camera: `camera` is used then.
    bool givesCamera() const { return m_givesCamera; }
    /// Returns the film of a scene without Film, in the aspect ratio of the camera.
    Statement film() const;
    /// Returns the camera of the first file that has one, or else a camera that sees all files.
    Statement camera(const V2i& resolution) const;

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
    Box3f m_bounds; ///< of all files, in the world
    std::vector<size_t> m_movingLights;
    size_t m_staticObjects = 0; ///< number of objects before beginFrame
    std::vector<size_t>
        m_staticInstances; ///< numbers of instances before beginFrame: of the world, of each object
};

} // namespace strobe
