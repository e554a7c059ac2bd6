// Imports glTF 2.0 files: shapes, materials, lights, cameras and their motion.
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

/// Reads a file and its buffers; images are read when they are first used. `where`: location of the reference
/// to the file. `policy`: which files may be read; null: all. Throws an Error at `where`.
std::shared_ptr<const Document> open(const std::filesystem::path& path, const Location& where,
                                     std::shared_ptr<const ResourcePolicy> policy = nullptr);

/// Returns true for the names of glTF files: .gltf or .glb.
bool isGltfName(const std::filesystem::path& path);

/// Returns the file itself and the files that it refers to.
std::vector<std::filesystem::path> filesOf(const Document& document);

/// The content of a file to import.
struct Settings {
    std::string scene;     ///< name of the scene; empty: the file's default
    std::string animation; ///< name of the animation; empty: the default of Clip
    std::string camera;    ///< name of the camera or its node; empty: the first in the scene
    bool lights = true;    ///< import the lights of KHR_lights_punctual
    /// Units of these lights: photometric units are divided by 683 lm/W; else candela are taken as W/sr and
    /// lux as W/m², as viewers do that show the file in a browser.
    bool photometric = true;
    bool culling = false;  ///< camera rays do not hit the back of surfaces that are not doubleSided
    float pointRadius = 0; ///< of points and lines, in units of the scene; 0: they are skipped
};

/// A material and the emission of its surfaces.
struct ImportedMaterial {
    std::string name;
    std::shared_ptr<const Material> material;
    Rgb emission{0};                                ///< radiance
    std::shared_ptr<const Texture> emissionTexture; ///< factor of the emission; null: 1
    bool doubleSided = false;                       ///< both sides emit
    Rgb absorption{0}; ///< inside, per unit of world space (KHR_materials_volume)
};

struct ImportedShape {
    std::shared_ptr<TriangleMesh> mesh; ///< keyTimes are in seconds
    int material = 0;                   ///< index into Importer::materials()
};

/// Shapes that do not deform, in the space of the nodes that show them.
struct ImportedObject {
    struct Instance {
        size_t node;
        bool moves;    ///< the node is animated
        M44f toNode{}; ///< from the shapes to the node (EXT_mesh_gpu_instancing)
    };
    std::string name;
    std::vector<ImportedShape> shapes;
    std::vector<Instance> instances;
};

struct ImportedLight {
    enum Kind { Point, Spot, Directional } kind = Point;
    size_t node = 0;
    bool moves = false;                   ///< the node is animated
    Rgb intensity{0};                     ///< W/sr; of directional lights, along -z, W/m²
    float innerAngle = 0, outerAngle = 0; ///< of spots, in radians from the axis
};

struct ImportedCamera {
    size_t node = 0;
    bool isPerspective = true;
    float halfHeight = 0; ///< tangent of half the vertical angle; orthographic: half the height
    float aspect = 0;     ///< width / height; 0: unspecified
};

/// The deformed shapes of a node during one shutter.
struct ImportedDeformation {
    std::string name;
    std::vector<ImportedShape> shapes;
    TransformChain toScene;
};

/// The content of a glTF file. Materials, lights and shapes that do not deform are created once; motion and
/// deformation are computed for each shutter, in seconds. All functions throw Errors that name the file and
/// the JSON path, and warn once about each ignored feature. `textures` and `diagnostics` must outlive the
/// importer.
class Importer {
  public:
    Importer(std::shared_ptr<const Document> document, const Settings& settings, TextureCache& textures,
             Diagnostics& diagnostics);
    ~Importer();

    const std::vector<ImportedMaterial>& materials() const;
    /// Moves out the objects that never deform.
    std::vector<ImportedObject> takeObjects();
    const std::vector<ImportedLight>& lights() const;
    const std::optional<ImportedCamera>& camera() const;
    /// Returns the bounds of all shapes at time 0, in the space of the scene.
    const Box3f& bounds() const;
    /// Returns vertices that are the farthest ones in evenly distributed directions, at any time of the
    /// animation, in the space of the scene. Empty for an empty scene.
    const std::vector<V3f>& extremes() const;

    /// Returns for each node its motion to the scene, with errors of at most 1e-5 of the scene's size and
    /// 1e-5 radians.
    std::vector<TransformChain> motions(const Shutter& shutter) const;
    /// Returns a chain of motions as a single transform, within the same tolerance.
    KeyedTransform flattened(const TransformChain& path, const Shutter& shutter) const;
    /// Returns the shapes that morph targets and skins deform. `motions`: those of the same shutter.
    std::vector<ImportedDeformation> deformations(const std::vector<TransformChain>& motions,
                                                  const Shutter& shutter) const;

  private:
    class Impl;
    std::unique_ptr<const Impl> m_impl;
    std::vector<ImportedObject> m_objects;
};

} // namespace strobe::gltf
