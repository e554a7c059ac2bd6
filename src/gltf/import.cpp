#include "gltf/import.h"

#include "gltf/deform.h"
#include "gltf/lights.h"
#include "gltf/material.h"

#include <algorithm>
#include <cctype>

namespace strobe::gltf {
namespace {

/// Deforming vertices stay this close to where they belong, as a fraction of their mesh's size: a twentieth
/// of a pixel when it is 2,500 pixels large.
constexpr float kDeformTolerance = 2e-5f;
/// More vertices than this in all, and the file is no scene but an attack: accessors can be used again and
/// again.
constexpr size_t kMaxVertices = size_t(1) << 30;

/// A mesh of the file as it is at rest.
struct ReadMesh {
    std::vector<Primitive> primitives;
    std::vector<Look> looks; ///< beside them
};

std::vector<size_t> targetCounts(const Document& document) {
    const tinygltf::Model& model = document.model();
    std::vector<size_t> counts;
    for (size_t i = 0; i < model.nodes.size(); ++i) {
        const int mesh = model.nodes[i].mesh;
        const std::string place = item("nodes", i) + ".mesh";
        counts.push_back(mesh < 0 ? 0 : morphTargetCount(document.at(model.meshes, mesh, "mesh", place)));
    }
    return counts;
}

void dress(Primitive& primitive, const Look& look) {
    if (const auto uvs = primitive.uvSets.find(look.uvSet); uvs != primitive.uvSets.end())
        primitive.mesh.uvs = uvs->second;
    else if (look.usesUvs) // as the specification has it
        primitive.mesh.uvs.assign(primitive.mesh.vertexCount(), V2f(0));
    primitive.mesh.alpha = look.alpha;
}

} // namespace

class Importer::Impl {
  public:
    Impl(std::shared_ptr<const Document> document, const Settings& settings, TextureCache& textures,
         Diagnostics& messages)
        : m_document(std::move(document)), m_messages(messages), m_tree(*m_document, settings.scene),
          m_clip(*m_document, settings.animation, targetCounts(*m_document), messages) {
        for (const std::string& extension : m_document->ignoredExtensions())
            m_document->warnOnce(messages, extension, "extensionsUsed", extension + " is ignored");
        MaterialBuilder materials(*m_document, textures, messages);
        m_meshes.resize(m_document->model().meshes.size());
        for (const size_t node : m_tree.order())
            if (source(node).mesh >= 0)
                readNode(node, materials);
        m_materials = materials.take();
        findBounds();
        if (settings.lights)
            m_lights = importLights(m_tree, m_clip, messages);
        m_camera = importCamera(m_tree, settings.camera);
    }

    /// Consumes nothing: a mesh that deforms elsewhere is needed again.
    std::vector<ImportedObject> objects() const {
        std::vector<ImportedObject> objects;
        std::map<int, size_t> shared; // by mesh, of those none of whose primitives deform
        for (const size_t node : m_tree.order()) {
            const int mesh = source(node).mesh;
            if (mesh < 0)
                continue;
            const ImportedObject::Place place{node, m_tree.moves(node, m_clip)};
            std::vector<ImportedShape> shapes;
            const bool deforms = anyDeforms(node);
            if (!deforms && shared.count(mesh)) {
                objects[shared[mesh]].places.push_back(place);
                continue;
            }
            const ReadMesh& read = *m_meshes[size_t(mesh)];
            for (size_t i = 0; i < read.primitives.size(); ++i)
                if (!deforms || !deformer(node, i).deforms())
                    shapes.push_back(
                        {std::make_shared<TriangleMesh>(read.primitives[i].mesh), read.looks[i].material});
            if (shapes.empty())
                continue;
            if (!deforms)
                shared[mesh] = objects.size();
            objects.push_back({m_document->model().meshes[size_t(mesh)].name, std::move(shapes), {place}});
        }
        return objects;
    }

    std::vector<ImportedDeformation> deformations(const std::vector<TransformChain>& motions,
                                                  const Shutter& shutter) const {
        std::vector<ImportedDeformation> out;
        for (const size_t node : m_tree.order()) {
            if (source(node).mesh < 0 || !anyDeforms(node))
                continue;
            const ReadMesh& read = *m_meshes[size_t(source(node).mesh)];
            // Skins place their vertices in the scene, the others are where their node is.
            ImportedDeformation skinned{source(node).name, {}, {}},
                morphed{source(node).name, {}, motions[node]};
            for (size_t i = 0; i < read.primitives.size(); ++i)
                if (const Deformer d = deformer(node, i); d.deforms())
                    (d.isSkinned() ? skinned : morphed)
                        .shapes.push_back(
                            {std::make_shared<TriangleMesh>(d.over(shutter, kDeformTolerance, m_messages)),
                             read.looks[i].material});
            for (ImportedDeformation* d : {&skinned, &morphed})
                if (!d->shapes.empty())
                    out.push_back(std::move(*d));
        }
        return out;
    }

    float size() const { return m_bounds.isEmpty() ? 1 : length(m_bounds.size()); }
    const NodeTree& tree() const { return m_tree; }
    const Clip& clip() const { return m_clip; }
    const std::vector<ImportedMaterial>& materials() const { return m_materials; }
    const std::vector<ImportedLight>& lights() const { return m_lights; }
    const std::optional<ImportedCamera>& camera() const { return m_camera; }
    const Box3f& bounds() const { return m_bounds; }

  private:
    const tinygltf::Node& source(size_t node) const { return m_document->model().nodes[node]; }

    void readNode(size_t node, MaterialBuilder& materials) {
        const auto index = size_t(source(node).mesh);
        if (!m_meshes[index]) {
            m_meshes[index] = ReadMesh{readMesh(*m_document, index, m_messages), {}};
            for (Primitive& p : m_meshes[index]->primitives) {
                countVertices(p);
                m_meshes[index]->looks.push_back(materials.look(p));
                dress(p, m_meshes[index]->looks.back());
            }
        }
        const int skin = source(node).skin;
        if (skin >= 0 && !m_skins.count(skin))
            m_skins[skin] = readSkin(*m_document, skin, item("nodes", node) + ".skin");
        if (anyDeforms(node)) // checks, too, that joints and weights fit
            for (const Primitive& p : m_meshes[index]->primitives)
                countVertices(p);
    }

    void countVertices(const Primitive& primitive) {
        m_vertices += primitive.mesh.vertexCount();
        if (m_vertices > kMaxVertices)
            m_document->fail(primitive.place,
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

    void findBounds() {
        const std::vector<M44f> globals = m_tree.globals(m_clip, 0);
        for (const size_t node : m_tree.order()) {
            if (source(node).mesh < 0)
                continue;
            const auto& primitives = m_meshes[size_t(source(node).mesh)]->primitives;
            for (size_t i = 0; i < primitives.size(); ++i) {
                const Deformer d = deformer(node, i);
                for (const V3f& p : d.deforms() ? d.positionsAt(0) : primitives[i].mesh.positions[0])
                    m_bounds.extendBy(d.isSkinned() ? p : transformPoint(globals[node], p));
            }
        }
        if (!m_bounds.isEmpty() && !std::isfinite(length2(m_bounds.size())))
            m_document->fail("", "the scene is too large for 32-bit floats");
    }

    std::shared_ptr<const Document> m_document;
    Diagnostics& m_messages;
    NodeTree m_tree;
    Clip m_clip;
    std::vector<std::optional<ReadMesh>> m_meshes; ///< those that the scene shows
    std::map<int, Skin> m_skins;
    std::vector<ImportedMaterial> m_materials;
    std::vector<ImportedLight> m_lights;
    std::optional<ImportedCamera> m_camera;
    Box3f m_bounds;
    size_t m_vertices = 0;
};

Importer::Importer(std::shared_ptr<const Document> document, const Settings& settings, TextureCache& textures,
                   Diagnostics& messages)
    : m_impl(std::make_unique<const Impl>(std::move(document), settings, textures, messages)),
      m_objects(m_impl->objects()) {}
Importer::~Importer() = default;

const std::vector<ImportedMaterial>& Importer::materials() const { return m_impl->materials(); }
std::vector<ImportedObject> Importer::takeObjects() { return std::move(m_objects); }
const std::vector<ImportedLight>& Importer::lights() const { return m_impl->lights(); }
const std::optional<ImportedCamera>& Importer::camera() const { return m_impl->camera(); }
const Box3f& Importer::bounds() const { return m_impl->bounds(); }

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
                                     std::shared_ptr<const ResourcePolicy> guard) {
    return std::make_shared<const Document>(path, where, std::move(guard));
}

std::vector<std::filesystem::path> filesOf(const Document& document) { return document.files(); }

bool isGltfName(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return extension == ".gltf" || extension == ".glb";
}

} // namespace strobe::gltf
