// The walks from the roots of light trees to leaves.
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

/// The largest number below 1: see kOneMinusEpsilon.
inline constexpr double kDoubleOneMinusEpsilon = 0x1.fffffffffffffp-1;

/// A shaded point and its tree.
struct LightTreePoint {
    LightPoint point;
    const LightSubtree* tree;
    float fraction; ///< of the tree's interval
};

/// Walks from the roots of trees to leaves, for all samples of a chunk, level by level: each node is
/// evaluated once for all samples of a point, and evaluations do not wait for each other.
class LightTreeWalks {
  public:
    /// Adds a sample of a point, which must remain. Those of a point follow each other with ascending `u` in
    /// [0,1). `probability`: of its tree.
    void add(const LightTreePoint& point, float probability, double u, int sample) {
        if (m_nodeCount == 0 || m_nodes[m_nodeCount - 1].point != &point)
            m_nodes[m_nodeCount++] = {&point, 0, probability, m_sampleCount, m_sampleCount};
        m_u[m_sampleCount] = u;
        m_sample[m_sampleCount++] = sample;
        ++m_nodes[m_nodeCount - 1].end;
    }
    /// Writes the choices of all samples.
    STROBE_FORCE_INLINE void finish(LightTree::Choice* choices) {
        while (m_nodeCount > 0) {
            Node children[kSoAWidth];
            int childCount = 0;
            for (int i = 0; i < m_nodeCount; ++i) {
                const LightTreePoint& point = *m_nodes[i].point;
                evaluateNode(*point.tree, m_nodes[i].index, point.fraction, point.point, m_evaluated[i]);
            }
            for (int i = 0; i < m_nodeCount; ++i)
                divide(m_nodes[i], m_evaluated[i], choices, children, childCount);
            std::copy_n(children, childCount, m_nodes);
            m_nodeCount = childCount;
        }
    }

  private:
    /// A node of the current level, and the samples that are below it.
    struct Node {
        const LightTreePoint* point;
        uint32_t index;
        float probability;
        int first, end; ///< samples
    };
    /// Divides the samples of a node among its children.
    STROBE_FORCE_INLINE void divide(const Node& node, const EvaluatedLightNode& e, LightTree::Choice* choices,
                                    Node* children, int& childCount) {
        const LightSubtree& tree = *node.point->tree;
        for (int i = node.first; i < node.end;) {
            const int child = e.childAt(m_u[i] * e.sum()), first = i;
            do
                ++i;
            while (i < node.end && m_u[i] * e.sum() < e.end[child]);
            const float probability = node.probability * float(double(e.importance[child]) / e.sum());
            const uint32_t index = tree.nodes[node.index].child[child];
            if (index & LightNode::kLeaf) {
                for (int k = first; k < i; ++k)
                    choices[m_sample[k]] = {tree.leaves[index & ~LightNode::kLeaf], probability};
                continue;
            }
            const double begin = child > 0 ? e.end[child - 1] : 0, scale = 1 / double(e.importance[child]);
            for (int k = first; k < i; ++k) // rounding may exceed the interval
                m_u[k] = std::clamp((m_u[k] * e.sum() - begin) * scale, 0., kDoubleOneMinusEpsilon);
            children[childCount++] = {node.point, index, probability, first, i};
        }
    }

    Node m_nodes[kSoAWidth]; ///< each has a sample
    EvaluatedLightNode m_evaluated[kSoAWidth];
    double m_u[kSoAWidth]; ///< in the node of the sample
    int m_sample[kSoAWidth];
    int m_nodeCount = 0, m_sampleCount = 0;
};

} // namespace strobe
