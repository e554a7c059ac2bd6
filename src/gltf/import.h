// glTF 2.0 files as shapes, materials, lights and cameras.
#pragma once

#include "core/image/texture_cache.h"
#include "core/interfaces/camera.h"
#include "core/interfaces/material.h"
#include "core/interfaces/shape.h"
#include "core/util/diagnostics.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace strobe::gltf {

class Document;

/// Reads a file with its buffers; images are read when they are used. `guard`: what may be read; null: all.
/// Throws an Error at `where`.
std::shared_ptr<const Document> open(const std::filesystem::path& path, const Location& where,
                                     std::shared_ptr<const ResourcePolicy> guard = nullptr);

/// True for the name of a file of this kind: .gltf or .glb.
bool isGltfName(const std::filesystem::path& path);

/// The file itself, and those that it refers to.
std::vector<std::filesystem::path> filesOf(const Document& document);

/// What of a file is wanted.
struct Settings {
    std::string scene;     ///< its name; empty: the file's own choice
    std::string animation; ///< its name; empty: the first, and those that move other things (see Clip)
    std::string camera;    ///< its name or its node's; empty: the first in the scene
    bool lights = true;    ///< take those of KHR_lights_punctual
};

/// How a surface reflects, and whether it shines.
struct ImportedMaterial {
    std::string name;
    std::shared_ptr<const Material> material;
    Rgb emission{0};                                ///< radiance
    std::shared_ptr<const Texture> emissionTexture; ///< a factor of it, or null
    bool doubleSided = false;                       ///< it shines on both sides
};

struct ImportedShape {
    std::shared_ptr<TriangleMesh> mesh; ///< its keyTimes are in seconds
    int material = 0;                   ///< index into Importer::materials()
};

/// Shapes at rest in their own space, and the nodes that show them.
struct ImportedObject {
    std::string name;
    std::vector<ImportedShape> shapes;
    struct Place {
        size_t node;
        bool moves; ///< at some time
    };
    std::vector<Place> places;
};

struct ImportedLight {
    enum Kind { Point, Spot, Directional } kind = Point;
    size_t node = 0;
    bool moves = false;                   ///< at some time
    Rgb intensity{0};                     ///< W/sr, or W/m² of directional ones; they shine along -z
    float innerAngle = 0, outerAngle = 0; ///< of spots, in radians from the axis
};

struct ImportedCamera {
    size_t node = 0;
    bool isPerspective = true;
    float halfHeight =
        0;            ///< perspective: the tangent of half the vertical angle; orthographic: half the height
    float aspect = 0; ///< width over height that the file wants; 0: it does not say
};

/// What a node deforms, for one shutter.
struct ImportedDeformation {
    std::string name;
    std::vector<ImportedShape> shapes;
    TransformChain toScene;
};

/// A file on its way into a scene: what does not depend on the time is made once, the rest for any number of
/// shutters (in seconds). Everything may throw Errors that name the file and the place in its JSON, and says
/// through `messages` (which must outlive it), once each, what is left out.
class Importer {
  public:
    Importer(std::shared_ptr<const Document> document, const Settings& settings, TextureCache& textures,
             Diagnostics& messages);
    ~Importer();

    const std::vector<ImportedMaterial>& materials() const;
    /// All that never deforms. The meshes are the caller's.
    std::vector<ImportedObject> takeObjects();
    const std::vector<ImportedLight>& lights() const;
    const std::optional<ImportedCamera>& camera() const;
    /// Of all shapes at time 0, in scene space.
    const Box3f& bounds() const;

    /// For each node its motion to the scene, followed to 1e-5 of the scene's size and 1e-5 radians.
    std::vector<TransformChain> motions(const Shutter& shutter) const;
    /// One of them as a single transform, to the same tolerance.
    KeyedTransform flattened(const TransformChain& path, const Shutter& shutter) const;
    /// What morph targets and skins deform.
    std::vector<ImportedDeformation> deformations(const std::vector<TransformChain>& motions,
                                                  const Shutter& shutter) const;

  private:
    class Impl;
    std::unique_ptr<const Impl> m_impl;
    std::vector<ImportedObject> m_objects;
};

} // namespace strobe::gltf
