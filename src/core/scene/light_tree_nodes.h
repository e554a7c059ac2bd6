// The nodes of a light tree and the importance of their children.
#pragma once

#include "core/math/soa.h"

#include <vector>

namespace strobe {

/// A shaded point, as the importance of lights depends on it. World space.
struct LightPoint {
    V3f p;
    V3f ng, ns;     ///< unit geometric and shading normal, on the side of the viewer
    bool transmits; ///< light from behind the surface counts, too
    float time;     ///< shutter fraction
};

/// A node of a light tree with up to eight children, as a structure of arrays: 48 bytes per child. The bounds
/// of a child are those of EmitterBounds. Unused slots have an intensity of 0.
struct alignas(64) LightNode {
    static constexpr int kWidth = 8;
    static constexpr uint32_t kLeaf = 1u << 31;  ///< marks a child that is a leaf
    float x[kWidth]{}, y[kWidth]{}, z[kWidth]{}; ///< center of the sphere at the begin of the tree's interval
    float radius[kWidth]{};                      ///< negative: the child emits on both sides
    float axisX[kWidth]{}, axisY[kWidth]{}, axisZ[kWidth]{};
    float cosSpread[kWidth]{}, sinSpread[kWidth]{};
    float cosEmission[kWidth]{};
    float intensity[kWidth]{};
    uint32_t child[kWidth]{}; ///< index of a node, or kLeaf and the index of a leaf
};

/// The motion of a node's children over the interval of the tree: 12 bytes per child.
struct LightNodeMotion {
    float x[LightNode::kWidth]{}, y[LightNode::kWidth]{}, z[LightNode::kWidth]{};
};

/// The tree of an interval of the shutter.
struct LightSubtree {
    static constexpr int kMaxLevels = 64; ///< the most nodes on the path to a leaf
    bool isOriented = false;              ///< false: all emitters emit equally in all directions
    std::vector<LightNode> nodes;         ///< the root is the first
    std::vector<LightNodeMotion> motions; ///< by node; empty: at rest
    std::vector<uint32_t> parents;        ///< by node: 8 times the parent's index plus the slot in it
    std::vector<uint32_t> leaves;         ///< by leaf: index of the emitter
    std::vector<uint32_t> slots;          ///< by emitter: 8 times the node's index plus the slot; or kNoSlot
    static constexpr uint32_t kNoSlot = ~0u; ///< the emitter is black, or not in the tree
};

} // namespace strobe
