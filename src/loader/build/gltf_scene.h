// glTF files as parts of a scene: what gltf/import.h makes of them, in the terms of a SceneDescription.
#pragma once

#include "loader/build/plugin_tables.h"
#include "loader/parser/description.h"

namespace strobe {

/// While the shutter of a scene is open that names no camera: half a frame of 24 a second, in seconds.
inline constexpr Shutter kGltfShutter{0, 1.f / 48};

/// The glTF files of a description. Scene time is their time, in seconds.
class GltfScene {
  public:
    /// Appends to the description all that never changes. If nothing lights the scene, a sky and a sun do.
    GltfScene(SceneDescription& description, TextureCache& textures, Diagnostics& messages);
    ~GltfScene();

    /// True when the scene has glTF files and names no camera: then `camera` gives it one.
    bool givesCamera() const { return m_givesCamera; }
    /// The film of a scene that names none: of the camera's proportions.
    Statement film() const;
    /// The file's camera (of several files, the first's that has one), or one that sees all of them.
    Statement camera(const V2i& resolution) const;

    /// Appends to the description what moves or deforms while the shutter is open. Lights that may move are
    /// those from `movingLights` on.
    void beginFrame(SceneDescription& description, const Shutter& shutter);
    /// Takes it away again.
    void endFrame(SceneDescription& description);
    /// Indices into SceneDescription::lights of the lights that frames differ in.
    const std::vector<size_t>& movingLights() const { return m_movingLights; }

  private:
    class File;

    std::vector<std::unique_ptr<File>> m_files;
    const File* m_cameraFile = nullptr; ///< null: a default view
    bool m_givesCamera = false;
    Box3f m_bounds; ///< of all files, in the world
    std::vector<size_t> m_movingLights;
    size_t m_stillObjects = 0;
    std::vector<size_t>
        m_stillInstances; ///< of the world, and of each object, how many instances are for ever
};

} // namespace strobe
