// Morph targets and skins: vertex positions over time, and their keys for a shutter.
#pragma once

#include "core/util/diagnostics.h"
#include "gltf/mesh.h"
#include "gltf/nodes.h"

namespace strobe::gltf {

/// A skin: joints, and the matrices from the mesh to the space of each joint.
struct Skin {
    std::vector<size_t> joints; ///< nodes
    std::vector<M44f> inverseBind;
};
/// Throws an Error if the skin is invalid. `jsonPath`: JSON path of the reference to it.
Skin readSkin(const Document& document, int index, const std::string& jsonPath);

/// A primitive as a node shows it: deformed by the weights of the node's morph targets and by its skin.
class Deformer {
  public:
    /// `skin`: null if the node has none. Throws an Error if a joint index or the number of weights is out of
    /// range.
    Deformer(const NodeTree& tree, const Clip& clip, const Primitive& primitive, size_t node,
             const Skin* skin);

    /// Returns true if vertices can differ from those of the primitive.
    bool deforms() const { return m_skin || m_morphs; }
    /// Returns true if vertices are in the space of the scene; else they are in the space of the node.
    bool isSkinned() const { return m_skin != nullptr; }
    std::vector<V3f> positionsAt(float time) const { return keyAt(time).positions; }
    /// Returns the mesh with keys at uniform steps over the shutter; keyTimes are in seconds. Steps are
    /// doubled, up to 128, until every vertex is within `relativeTolerance` of the mesh's size from its
    /// position, tested at quarters of each step. Warns if 128 steps do not suffice.
    TriangleMesh meshDuring(const Shutter& shutter, float relativeTolerance, Diagnostics& diagnostics) const;

  private:
    struct Key {
        std::vector<V3f> positions, normals;
    };
    Key keyAt(float time) const;
    std::vector<float> weightsAt(float time) const;
    void morph(Key& key, float time) const;
    void skin(Key& key, float time) const;
    bool changes(const Shutter& shutter) const;
    bool isClose(const std::vector<Key>& keys, const Shutter& shutter, float tolerance,
                 std::vector<Key>& quarters) const;
    std::vector<Key> keysDuring(const Shutter& shutter, float relativeTolerance,
                                Diagnostics& diagnostics) const;

    const NodeTree& m_tree;
    const Clip& m_clip;
    const Primitive& m_primitive;
    const size_t m_node;
    const Skin* m_skin;
    bool m_morphs = false;
    std::vector<float> m_weights; ///< of the morph targets, where they are not animated
};

} // namespace strobe::gltf
