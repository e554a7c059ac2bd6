// Builds light trees.
#pragma once

#include "core/interfaces/emitter_bounds.h"
#include "core/scene/light_tree_nodes.h"

#include <span>

namespace strobe {

/// An emitter of a tree to be built.
struct TreeEmitter {
    EmitterBounds bounds;
    uint32_t index;
};

/// Returns the tree of emitters, whose bounds are those of one interval of the shutter. Black emitters are
/// left out. The tree is split from the top by the surface area orientation heuristic (Conty Estevez and
/// Kulla 2018, section 4.4), with the square of the diagonal in place of the area, so that emitters in a
/// plane or on a line are split well, too. `isMoving`: the nodes have motions, and emitters are split by
/// velocity, too. `emitterCount` is the number of emitters of the scene.
LightSubtree buildLightTree(std::vector<TreeEmitter> emitters, size_t emitterCount, bool isMoving);

/// Returns nodes whose children are all emitters, for exhaustive sampling.
LightSubtree listEmitters(std::vector<TreeEmitter> emitters, size_t emitterCount, bool isMoving);

/// Returns the expected importance of the children that a point meets, up to a factor: the sum over all
/// children of nodes of their intensity times the squares of their radii and the extents of their cones. It
/// falls if the bounds of moving lights become tighter.
double treeCost(const LightSubtree& tree);

/// Returns the cost of a tree whose leaves have other bounds: those of `emitters`, in the order of the
/// leaves.
double treeCost(const LightSubtree& tree, std::span<TreeEmitter> emitters);

} // namespace strobe
