// The walk from the root of a light tree to a leaf.
#pragma once

#include "core/scene/light_tree.h"
#include "core/scene/light_tree_importance.h"

#include <algorithm>

namespace strobe {

/// A node at one point: the importances of its children, and the ends of their intervals in [0, the sum].
struct EvaluatedLightNode {
    static constexpr int kWidth = LightNode::kWidth;
    static_assert(kWidth == 8);

    uint32_t index = ~0u;
    float importance[kWidth];
    double end[kWidth];
    double sum() const { return end[kWidth - 1]; }

    /// Computes `end`: in pairs, which depend on fewer sums in a row.
    STROBE_FORCE_INLINE void accumulate() {
        double w[kWidth];
        for (int i = 0; i < kWidth; ++i)
            w[i] = double(importance[i]);
        const double w01 = w[0] + w[1], w0123 = w01 + (w[2] + w[3]), w45 = w[4] + w[5];
        end[0] = w[0];
        end[1] = w01;
        end[2] = w01 + w[2];
        end[3] = w0123;
        end[4] = w0123 + w[4];
        end[5] = w0123 + w45;
        end[6] = end[5] + w[6];
        end[7] = end[5] + (w[6] + w[7]);
    }
};

/// Chooses a child with a probability proportional to its importance. `u` in [0,1) is replaced by its
/// position in the child's interval.
STROBE_FORCE_INLINE int chooseChild(const EvaluatedLightNode& e, double& u) {
    const double target = u * e.sum();
    int child = 0;
    for (int i = 0; i < LightNode::kWidth; ++i)
        child += e.end[i] <= target ? 1 : 0;
    child = std::min(child, LightNode::kWidth - 1);
    while (child > 0 && e.importance[child] == 0) // u was rounded up
        --child;
    const double begin = child > 0 ? e.end[child - 1] : 0;
    u = std::clamp((target - begin) / double(e.importance[child]), 0., 0x1.fffffffffffffp-1);
    return child;
}

/// Computes the importances of the children of node `index`.
STROBE_FORCE_INLINE const LightNode& computeImportances(const LightSubtree& tree, uint32_t index,
                                                        float fraction, const LightPoint& point,
                                                        float* importance) {
    const LightNode& node = tree.nodes[index];
    const LightNodeMotion* motion = tree.motions.empty() ? nullptr : &tree.motions[index];
    if (tree.isOriented) {
        if (motion)
            computeImportance<true, true>(node, motion, fraction, point, importance);
        else
            computeImportance<true, false>(node, motion, fraction, point, importance);
    } else {
        if (motion)
            computeImportance<false, true>(node, motion, fraction, point, importance);
        else
            computeImportance<false, false>(node, motion, fraction, point, importance);
    }
    return node;
}

/// Evaluates a node for `descend`. Importances that are all 0 are replaced by intensities, so that the
/// probabilities of the children have the sum 1.
STROBE_FORCE_INLINE void evaluateNode(const LightSubtree& tree, uint32_t index, float fraction,
                                      const LightPoint& point, EvaluatedLightNode& e) {
    const LightNode& node = computeImportances(tree, index, fraction, point, e.importance);
    e.index = index;
    e.accumulate();
    if (!(e.sum() > 0)) {
        std::copy_n(node.intensity, LightNode::kWidth, e.importance);
        e.accumulate();
    }
}

/// A cache of the nodes that the latest walk from a point evaluated, by depth.
struct LightTreeWalk {
    static constexpr int kLevels = 12;
    EvaluatedLightNode levels[kLevels]; ///< deeper nodes use the last one
    double importance = -1;             ///< of all emitters; negative: not computed

    void startAtOtherPoint() {
        importance = -1;
        for (EvaluatedLightNode& level : levels)
            level.index = ~0u;
    }
};

/// Walks from the root to a leaf.
STROBE_FORCE_INLINE LightTree::Choice descend(const LightSubtree& tree, float fraction,
                                              const LightPoint& point, double u, float probability,
                                              LightTreeWalk& walk) {
    uint32_t index = 0;
    for (int depth = 0;; ++depth) {
        EvaluatedLightNode& e = walk.levels[std::min(depth, LightTreeWalk::kLevels - 1)];
        if (e.index != index)
            evaluateNode(tree, index, fraction, point, e);
        const int child = chooseChild(e, u);
        probability *= float(double(e.importance[child]) / e.sum());
        index = tree.nodes[index].child[child];
        if (index & LightNode::kLeaf)
            return {tree.leaves[index & ~LightNode::kLeaf], probability};
    }
}

} // namespace strobe
