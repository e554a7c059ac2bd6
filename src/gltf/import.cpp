#include "gltf/import.h"

#include "gltf/deform.h"
#include "gltf/extremes.h"
#include "gltf/instancing.h"
#include "gltf/lights.h"
#include "gltf/material.h"

#include <algorithm>
#include <cctype>

namespace strobe::gltf {
namespace {

/// Tolerance of deforming vertices, as a fraction of the mesh's size: a twentieth of a pixel for a mesh of
/// 2,500 pixels.
constexpr float kDeformTolerance = 2e-5f;
/// Limit of the vertices of a scene. The size of the file does not bound them, since meshes may share
/// accessors.
constexpr size_t kMaxVertices = size_t(1) << 30;

/// A mesh of the file before deformation.
struct BoundMesh {
    std::vector<Primitive> primitives;
    std::vector<MaterialBinding> bindings; ///< by primitive
};

/// Returns the number of morph targets by node.
std::vector<size_t> targetCounts(const Document& document) {
    const tinygltf::Model& model = document.model();
    std::vector<size_t> counts;
    for (size_t i = 0; i < model.nodes.size(); ++i) {
        const int mesh = model.nodes[i].mesh;
        const std::string jsonPath = item("nodes", i) + ".mesh";
        counts.push_back(mesh < 0 ? 0 : morphTargetCount(document.at(model.meshes, mesh, "mesh", jsonPath)));
    }
    return counts;
}

/// Sets the mesh's texture coordinates, alpha and culled side.
void applyBinding(Primitive& primitive, const MaterialBinding& binding, const Settings& settings) {
    if (const auto uvs = primitive.uvSets.find(binding.uvSet); uvs != primitive.uvSets.end())
        primitive.mesh.uvs = uvs->second;
    else if (binding.usesUvs) // glTF: missing texture coordinates are zero
        primitive.mesh.uvs.assign(primitive.mesh.vertexCount(), V2f(0));
    primitive.mesh.alpha = binding.alpha;
    if (settings.culling && !binding.doubleSided)
        primitive.mesh.culledSide = TriangleMesh::Side::Back;
}

/// Returns the document. Warns of what was replaced in it.
std::shared_ptr<const Document> checked(std::shared_ptr<const Document> document, Diagnostics& diagnostics) {
    document->tolerateReplaced(diagnostics);
    return document;
}

} // namespace

class Importer::Impl {
  public:
    Impl(std::shared_ptr<const Document> document, const Settings& settings, TextureCache& textures,
         Diagnostics& diagnostics)
        : m_document(checked(std::move(document), diagnostics)), m_settings(settings),
          m_diagnostics(diagnostics), m_tree(*m_document, settings.scene),
          m_clip(*m_document, settings.animation, targetCounts(*m_document), diagnostics) {
        for (const std::string& extension : m_document->ignoredExtensions())
            m_document->warnOnce(diagnostics, extension, "extensionsUsed", extension + " is ignored");
        MaterialBuilder materials(*m_document, textures, diagnostics);
        m_meshes.resize(m_document->model().meshes.size());
        for (const size_t node : m_tree.order())
            if (source(node).mesh >= 0)
                readNode(node, materials);
        m_materials = materials.take();
        findBounds();
        if (settings.lights)
            m_lights = importLights(m_tree, m_clip, settings.photometric, diagnostics);
        m_camera = importCamera(m_tree, settings.camera);
        m_document->tolerateAll(diagnostics);
    }

    /// Returns the objects that never deform. Meshes are copied: other nodes may deform the same mesh.
    std::vector<ImportedObject> objects() const {
        std::vector<ImportedObject> objects;
        std::map<int, size_t> shared; // object by mesh, for nodes that deform no primitive of it
        for (const size_t node : m_tree.order()) {
            const int mesh = source(node).mesh;
            if (mesh < 0)
                continue;
            std::vector<ImportedObject::Instance> instances;
            for (const M44f& toNode : instanceTransforms(*m_document, node))
                instances.push_back({node, m_tree.moves(node, m_clip), toNode});
            std::vector<ImportedShape> shapes;
            const bool deforms = anyDeforms(node);
            if (!deforms && shared.count(mesh)) {
                auto& all = objects[shared[mesh]].instances;
                all.insert(all.end(), instances.begin(), instances.end());
                continue;
            }
            const BoundMesh& bound = *m_meshes[size_t(mesh)];
            for (size_t i = 0; i < bound.primitives.size(); ++i)
                if (!deforms || !deformer(node, i).deforms())
                    shapes.push_back({std::make_shared<TriangleMesh>(bound.primitives[i].mesh),
                                      bound.bindings[i].material});
            if (shapes.empty())
                continue;
            if (!deforms)
                shared[mesh] = objects.size();
            objects.push_back(
                {m_document->model().meshes[size_t(mesh)].name, std::move(shapes), std::move(instances)});
        }
        return objects;
    }

    std::vector<ImportedDeformation> deformations(const std::vector<TransformChain>& motions,
                                                  const Shutter& shutter) const {
        std::vector<ImportedDeformation> out;
        for (const size_t node : m_tree.order()) {
            if (source(node).mesh < 0 || !anyDeforms(node))
                continue;
            const BoundMesh& bound = *m_meshes[size_t(source(node).mesh)];
            // The vertices of skins are in the scene's space, others in the node's.
            ImportedDeformation skinned{source(node).name, {}, {}};
            ImportedDeformation morphed{source(node).name, {}, motions[node]};
            for (size_t i = 0; i < bound.primitives.size(); ++i) {
                const Deformer d = deformer(node, i);
                if (!d.deforms())
                    continue;
                auto mesh =
                    std::make_shared<TriangleMesh>(d.meshDuring(shutter, kDeformTolerance, m_diagnostics));
                (d.isSkinned() ? skinned : morphed)
                    .shapes.push_back({std::move(mesh), bound.bindings[i].material});
            }
            for (ImportedDeformation* d : {&skinned, &morphed})
                if (!d->shapes.empty())
                    out.push_back(std::move(*d));
        }
        return out;
    }

    /// Returns the diagonal of the bounds; 1 for an empty scene.
    float size() const { return m_bounds.isEmpty() ? 1 : length(m_bounds.size()); }
    const NodeTree& tree() const { return m_tree; }
    const Clip& clip() const { return m_clip; }
    const std::vector<ImportedMaterial>& materials() const { return m_materials; }
    const std::vector<ImportedLight>& lights() const { return m_lights; }
    const std::optional<ImportedCamera>& camera() const { return m_camera; }
    const Box3f& bounds() const { return m_bounds; }
    const std::vector<V3f>& extremes() const { return m_extremes; }

  private:
    const tinygltf::Node& source(size_t node) const { return m_document->model().nodes[node]; }

    void readNode(size_t node, MaterialBuilder& materials) {
        const auto index = size_t(source(node).mesh);
        if (!m_meshes[index]) {
            m_meshes[index] = BoundMesh{readMesh(*m_document, index, pointRadiusIn(node), m_diagnostics), {}};
            for (Primitive& p : m_meshes[index]->primitives) {
                countVertices(p);
                m_meshes[index]->bindings.push_back(materials.bind(p));
                applyBinding(p, m_meshes[index]->bindings.back(), m_settings);
            }
        }
        const int skin = source(node).skin;
        if (skin >= 0 && !m_skins.count(skin))
            m_skins[skin] = readSkin(*m_document, skin, item("nodes", node) + ".skin");
        if (anyDeforms(node)) // also checks joints and weights
            for (const Primitive& p : m_meshes[index]->primitives)
                countVertices(p);
    }

    /// Returns the radius of points and lines in the space of a node, at time 0.
    float pointRadiusIn(size_t node) {
        if (m_settings.pointRadius == 0)
            return 0;
        if (m_globals.empty())
            m_globals = m_tree.globals(m_clip, 0);
        const float scale = std::cbrt(std::abs(determinant3(m_globals[node])));
        const float radius = m_settings.pointRadius / scale;
        return std::isfinite(radius) ? radius : m_settings.pointRadius;
    }

    void countVertices(const Primitive& primitive) {
        m_vertices += primitive.mesh.vertexCount();
        if (m_vertices > kMaxVertices)
            m_document->fail(primitive.jsonPath,
                             "the scene has more than " + std::to_string(kMaxVertices) + " vertices");
    }

    Deformer deformer(size_t node, size_t primitive) const {
        const auto skin = m_skins.find(source(node).skin);
        return Deformer(m_tree, m_clip, m_meshes[size_t(source(node).mesh)]->primitives[primitive], node,
                        skin == m_skins.end() ? nullptr : &skin->second);
    }
    bool anyDeforms(size_t node) const {
        const size_t count = m_meshes[size_t(source(node).mesh)]->primitives.size();
        for (size_t i = 0; i < count; ++i)
            if (deformer(node, i).deforms())
                return true;
        return false;
    }

    /// Calls visit(p) for the vertices at a time, in the space of the scene; if `movingOnly`, for those of
    /// nodes that move or deform.
    template <class Visit>
    void forVertices(float time, bool movingOnly, const Visit& visit) const {
        const std::vector<M44f> globals = m_tree.globals(m_clip, time);
        for (const size_t node : m_tree.order()) {
            if (source(node).mesh < 0)
                continue;
            const auto& primitives = m_meshes[size_t(source(node).mesh)]->primitives;
            for (size_t i = 0; i < primitives.size(); ++i) {
                const Deformer d = deformer(node, i);
                if (movingOnly && !d.deforms() && !m_tree.moves(node, m_clip))
                    continue;
                const auto visitAll = [&](const std::vector<V3f>& positions, const M44f& toScene) {
                    for (const V3f& p : positions)
                        visit(d.isSkinned() ? p : transformPoint(toScene, p));
                };
                if (d.deforms())
                    visitAll(d.positionsAt(time), globals[node]);
                else
                    for (const M44f& toNode : instanceTransforms(*m_document, node))
                        visitAll(primitives[i].mesh.positions[0], toNode * globals[node]);
            }
        }
    }

    void findBounds() {
        constexpr int kTimes = 12; // of an animation, to frame all of it
        Extremes extremes;
        forVertices(0, false, [&](const V3f& p) {
            m_bounds.extendBy(p);
            extremes.add(p);
        });
        const float duration = m_clip.duration();
        for (int i = 1; i <= kTimes && duration > 0; ++i)
            forVertices(duration * float(i) / kTimes, true, [&](const V3f& p) { extremes.add(p); });
        m_extremes = extremes.points();
        if (!m_bounds.isEmpty() && !std::isfinite(length2(m_bounds.size())))
            m_document->fail("", "the scene is too large for 32-bit floats");
    }

    std::shared_ptr<const Document> m_document;
    const Settings m_settings;
    Diagnostics& m_diagnostics;
    NodeTree m_tree;
    Clip m_clip;
    std::vector<M44f> m_globals; ///< from nodes to the scene, at time 0; empty until it is needed
    std::vector<std::optional<BoundMesh>> m_meshes; ///< by mesh; empty: not in the scene
    std::map<int, Skin> m_skins;
    std::vector<ImportedMaterial> m_materials;
    std::vector<ImportedLight> m_lights;
    std::optional<ImportedCamera> m_camera;
    Box3f m_bounds;
    std::vector<V3f> m_extremes;
    size_t m_vertices = 0;
};

Importer::Importer(std::shared_ptr<const Document> document, const Settings& settings, TextureCache& textures,
                   Diagnostics& diagnostics)
    : m_impl(std::make_unique<const Impl>(std::move(document), settings, textures, diagnostics)),
      m_objects(m_impl->objects()) {}
Importer::~Importer() = default;

const std::vector<ImportedMaterial>& Importer::materials() const { return m_impl->materials(); }
std::vector<ImportedObject> Importer::takeObjects() { return std::move(m_objects); }
const std::vector<ImportedLight>& Importer::lights() const { return m_impl->lights(); }
const std::optional<ImportedCamera>& Importer::camera() const { return m_impl->camera(); }
const Box3f& Importer::bounds() const { return m_impl->bounds(); }
const std::vector<V3f>& Importer::extremes() const { return m_impl->extremes(); }

std::vector<TransformChain> Importer::motions(const Shutter& shutter) const {
    return motionPaths(m_impl->tree(), m_impl->clip(), shutter, m_impl->size());
}

KeyedTransform Importer::flattened(const TransformChain& path, const Shutter& shutter) const {
    MotionTolerance tolerance;
    tolerance.distance = tolerance.relative * m_impl->size();
    return gltf::flattened(path, shutter, tolerance);
}

std::vector<ImportedDeformation> Importer::deformations(const std::vector<TransformChain>& motions,
                                                        const Shutter& shutter) const {
    return m_impl->deformations(motions, shutter);
}

std::shared_ptr<const Document> open(const std::filesystem::path& path, const Location& where,
                                     std::shared_ptr<const ResourcePolicy> policy) {
    return std::make_shared<const Document>(path, where, std::move(policy));
}

std::vector<std::filesystem::path> filesOf(const Document& document) { return document.files(); }

bool isGltfName(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return extension == ".gltf" || extension == ".glb";
}

} // namespace strobe::gltf
