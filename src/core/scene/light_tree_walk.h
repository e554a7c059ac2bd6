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

    /// Returns the child whose interval contains `target` in [0, the sum].
    STROBE_FORCE_INLINE int childAt(double target) const {
        int child = 0;
        for (int i = 0; i < kWidth; ++i)
            child += end[i] <= target ? 1 : 0;
        child = std::min(child, kWidth - 1);
        while (child > 0 && importance[child] == 0) // the target was rounded up
            --child;
        return child;
    }
};

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

/// Evaluates a node. Importances that are all 0 are replaced by intensities, so that the probabilities of
/// the children have the sum 1.
STROBE_FORCE_INLINE void evaluateNode(const LightSubtree& tree, uint32_t index, float fraction,
                                      const LightPoint& point, EvaluatedLightNode& e) {
    const LightNode& node = computeImportances(tree, index, fraction, point, e.importance);
    e.accumulate();
    if (!(e.sum() > 0)) {
        std::copy_n(node.intensity, LightNode::kWidth, e.importance);
        e.accumulate();
    }
}

/// The path of the latest walk from a point, for walks with ascending numbers.
struct LightTreeWalk {
    static constexpr int kMaxLevels = 64; ///< of any tree
    /// A node of the path. Numbers in [begin, end) choose it.
    struct Level {
        EvaluatedLightNode node;
        uint32_t index;
        float probability;
        double begin, end;
        double scale; ///< of numbers to the node's intervals
    };
    Level levels[kMaxLevels];
    int depth = 0;
    double importance = -1; ///< of all emitters; negative: not computed

    void startAtOtherPoint() {
        depth = 0;
        importance = -1;
    }
    STROBE_FORCE_INLINE void enter(const LightSubtree& tree, uint32_t index, float fraction,
                                   const LightPoint& point, float probability, double begin, double end) {
        Level& l = levels[depth++];
        evaluateNode(tree, index, fraction, point, l.node);
        l.index = index;
        l.probability = probability;
        l.begin = begin;
        l.end = end;
        l.scale = l.node.sum() / (end - begin);
    }
};

/// Walks to the leaf that `u` in [0,1) chooses, from the deepest node of the latest path that contains u.
/// `probability`: of the root.
STROBE_FORCE_INLINE LightTree::Choice descend(const LightSubtree& tree, float fraction,
                                              const LightPoint& point, double u, float probability,
                                              LightTreeWalk& walk) {
    if (walk.depth == 0)
        walk.enter(tree, 0, fraction, point, probability, 0, 1);
    while (walk.depth > 1 && !(u < walk.levels[walk.depth - 1].end))
        --walk.depth;
    for (;;) {
        const LightTreeWalk::Level& l = walk.levels[walk.depth - 1];
        const EvaluatedLightNode& e = l.node;
        const int child = e.childAt(std::max((u - l.begin) * l.scale, 0.));
        const float childProbability = l.probability * float(double(e.importance[child]) / e.sum());
        const uint32_t index = tree.nodes[l.index].child[child];
        if (index & LightNode::kLeaf)
            return {tree.leaves[index & ~LightNode::kLeaf], childProbability};
        const double begin = child > 0 ? l.begin + e.end[child - 1] / l.scale : l.begin;
        walk.enter(tree, index, fraction, point, childProbability, begin, l.begin + e.end[child] / l.scale);
    }
}

} // namespace strobe
