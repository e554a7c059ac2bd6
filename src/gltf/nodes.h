// The node tree: its transforms at a time, and its motions during a shutter.
#pragma once

#include "core/math/transform.h"
#include "gltf/animation.h"

namespace strobe::gltf {

/// Returns the matrix of a translation, a unit quaternion x y z w, and a scale. Scales near 0 become tiny
/// ones.
M44f matrixOf(const V3f& translation, const float* quaternion, const V3f& scale);

/// The nodes of one scene of the document. Matrices are Imath's: p' = p * M.
class NodeTree {
  public:
    /// `scene`: name of the scene; empty: the file's default, else its first scene, else all root nodes.
    /// Throws an Error if the nodes are no tree or the name is unknown.
    NodeTree(const Document& document, const std::string& scene);

    /// The nodes of the scene, parents before children.
    const std::vector<size_t>& order() const { return m_order; }
    /// Returns the parent of a node; -1: none.
    int parent(size_t node) const { return m_parents[node]; }
    /// Returns the transform of a node to its parent at `time`, in seconds.
    M44f local(size_t node, const Clip& clip, float time) const;
    /// Returns the transform of each node to the scene; for nodes outside the scene, to their root.
    std::vector<M44f> globals(const Clip& clip, float time) const;
    /// Returns true if the node or an ancestor is animated.
    bool moves(size_t node, const Clip& clip) const;
    const Document& document() const { return m_document; }

  private:
    /// The transform of a node in its file: translation, rotation and scale, or a matrix.
    struct Pose {
        V3f translation{0}, scale{1};
        float rotation[4] = {0, 0, 0, 1}; ///< x y z w
        M44f matrix;
        bool isMatrix = false;
    };
    Pose poseOf(size_t node) const;
    void findParents();
    void findAllNodes();
    void findSceneNodes(const std::string& scene);
    void visit(int root, const std::string& jsonPath);

    const Document& m_document;
    std::vector<int> m_parents; ///< -1: a root
    std::vector<Pose> m_poses;
    std::vector<size_t> m_order; ///< nodes of the scene, parents first
    std::vector<size_t> m_all;   ///< nodes of the file, parents first
    std::vector<bool> m_visited;
};

/// The tolerance of motions: `distance` for translation, in units of the scene; `relative` for rotation, in
/// radians, and as a fraction of the scale.
struct MotionTolerance {
    float distance = 0, relative = 1e-5f;
};

/// Returns the motion of a node to its parent during the shutter: keys at the corners of its curves, and
/// between them as many as the tolerance needs. Static if the node is not animated.
KeyedTransform localMotion(const NodeTree& tree, const Clip& clip, size_t node, const Shutter& shutter,
                           const MotionTolerance& tolerance);

/// Returns for each node of the tree its motion to the scene, a chain of local motions.
std::vector<TransformChain> motionPaths(const NodeTree& tree, const Clip& clip, const Shutter& shutter,
                                        float sceneSize);

/// Returns a chain of motions as a single transform within the tolerance, for cameras and lights.
KeyedTransform flattened(const TransformChain& path, const Shutter& shutter,
                         const MotionTolerance& tolerance);

} // namespace strobe::gltf
