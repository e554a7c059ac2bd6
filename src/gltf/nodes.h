// The node tree: checked to be one, its transforms at any time, and its motions over the shutter.
#pragma once

#include "core/math/transform.h"
#include "gltf/animation.h"

namespace strobe::gltf {

/// The nodes of one scene of the document. Matrices are Imath's: p' = p * M.
class NodeTree {
  public:
    /// `scene`: a name, or empty for the file's own choice, else the first scene, else all root nodes.
    NodeTree(const Document& document, const std::string& scene);

    /// The nodes of the scene, parents before children.
    const std::vector<size_t>& order() const { return m_order; }
    int parent(size_t node) const { return m_parents[node]; }
    /// Node to its parent at `time`, in seconds.
    M44f local(size_t node, const Clip& clip, float time) const;
    /// Each node to the scene; of nodes outside the scene, to the root of their own tree.
    std::vector<M44f> globals(const Clip& clip, float time) const;
    /// True when the node or one above it is animated.
    bool moves(size_t node, const Clip& clip) const;
    const Document& document() const { return m_document; }

  private:
    /// A node's own translation, rotation and scale; or its matrix.
    struct Pose {
        V3f translation{0}, scale{1};
        float rotation[4] = {0, 0, 0, 1}; ///< x y z w
        M44f matrix;
        bool isMatrix = false;
    };
    Pose poseOf(size_t node) const;
    void findParents();
    void visit(int root, const std::string& place);

    const Document& m_document;
    std::vector<int> m_parents; ///< -1: a root
    std::vector<Pose> m_poses;
    std::vector<size_t> m_order, m_all; ///< of the scene, of the file: parents first
    std::vector<bool> m_visited;
};

/// How exactly motions are followed: `distance` in units of the scene (at the root), `relative` for angles in
/// radians and for factors of scale.
struct MotionTolerance {
    float distance = 0, relative = 1e-5f;
};

/// A node's local transforms over the shutter: keys at the corners of its curves, and between them as many
/// as keep interpolation within the tolerance. Still when it rests.
KeyedTransform localMotion(const NodeTree& tree, const Clip& clip, size_t node, const Shutter& shutter,
                           const MotionTolerance& tolerance);

/// For each node of the tree its motion to the scene, as the chain of local motions.
std::vector<TransformChain> motionPaths(const NodeTree& tree, const Clip& clip, const Shutter& shutter,
                                        float sceneSize);

/// A chain of motions as one, resampled to the tolerance: for things that take no chain. `breaks`: times
/// where it may have corners.
KeyedTransform flattened(const TransformChain& path, const Shutter& shutter,
                         const MotionTolerance& tolerance);

} // namespace strobe::gltf
