// Morph targets and skins: where vertices are at a time, and as many keys of them as the shutter needs.
#pragma once

#include "gltf/mesh.h"
#include "gltf/nodes.h"

namespace strobe::gltf {

/// A skin: joints with the matrices that take the mesh to each joint's space.
struct Skin {
    std::vector<size_t> joints; ///< nodes
    std::vector<M44f> inverseBind;
};
Skin readSkin(const Document& document, int index, const std::string& place);

/// One primitive as a node shows it: deformed by the node's weights and skin.
class Deformer {
  public:
    /// `skin` may be null: then vertices stay in the mesh's space. Throws when a joint number is wild.
    Deformer(const NodeTree& tree, const Clip& clip, const Primitive& primitive, size_t node,
             const Skin* skin);

    /// True when anything of it changes at all: else the primitive may be taken as it is.
    bool deforms() const { return m_skin || m_morphs; }
    /// True when its vertices are the scene's, not the node's.
    bool isSkinned() const { return m_skin != nullptr; }
    std::vector<V3f> positionsAt(float time) const { return at(time).positions; }
    /// The mesh over the shutter: keys at equal steps, as few (by doubling, at most 129) as keep every vertex
    /// within `relativeTolerance` of the mesh's size from where it is, tested at quarters of each step.
    /// keyTimes are in seconds.
    TriangleMesh over(const Shutter& shutter, float relativeTolerance, Diagnostics& messages) const;

  private:
    struct Key {
        std::vector<V3f> positions, normals;
    };
    Key at(float time) const;
    std::vector<float> weightsAt(float time) const;
    void morph(Key& key, float time) const;
    void skin(Key& key, float time) const;
    bool changes(const Shutter& shutter) const;
    bool isClose(const std::vector<Key>& keys, const Shutter& shutter, float tolerance,
                 std::vector<Key>& quarters) const;
    std::vector<Key> keysOver(const Shutter& shutter, float relativeTolerance, Diagnostics& messages) const;

    const NodeTree& m_tree;
    const Clip& m_clip;
    const Primitive& m_primitive;
    const size_t m_node;
    const Skin* m_skin;
    bool m_morphs = false;
    std::vector<float> m_weights; ///< at rest
};

} // namespace strobe::gltf
