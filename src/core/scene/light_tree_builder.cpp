#include "core/scene/light_tree_builder.h"

#include <cmath>
#include <span>

namespace strobe {

namespace {

/// The dimensions in which emitters are split: position in the middle of the interval, and velocity.
constexpr int kPositionAxes = 3, kMaxAxes = 6;

float coordinate(const EmitterBounds& b, int axis) {
    return axis < kPositionAxes ? (b.begin[axis] + b.end[axis]) / 2
                                : b.end[axis - kPositionAxes] - b.begin[axis - kPositionAxes];
}

/// Returns the measure of the directions that a cone of normals emits to (Conty Estevez and Kulla 2018,
/// equation 1).
float orientationMeasure(float spread, float emission) {
    if (spread >= kPi)
        return 4 * kPi;
    const float sum = std::min(spread + emission, kPi);
    return 2 * kPi * (1 - std::cos(spread)) + kPi / 2 *
                                                  (2 * sum * std::sin(spread) - std::cos(spread - 2 * sum) -
                                                   2 * spread * std::sin(spread) + std::cos(spread));
}

/// Sums over emitters from which the cost of a node follows. The cone of normals is estimated from the mean
/// of the axes.
struct ClusterSums {
    Box3f begin, end;                              ///< of the spheres at both ends of the interval
    V3f axes{0};                                   ///< times intensity
    float intensity = 0, spread = 0, emission = 0; ///< spread: times intensity
    bool isTwoSided = false;
    uint32_t count = 0;

    void add(const EmitterBounds& b) {
        const V3f r(b.radius);
        begin.extendBy(Box3f(b.begin - r, b.begin + r));
        end.extendBy(Box3f(b.end - r, b.end + r));
        axes += b.axis * b.intensity;
        intensity += b.intensity;
        spread += b.spread * b.intensity;
        emission = std::max(emission, b.emission);
        isTwoSided |= b.isTwoSided;
        ++count;
    }
    void add(const ClusterSums& s) {
        if (s.count == 0)
            return;
        begin.extendBy(s.begin);
        end.extendBy(s.end);
        axes += s.axes;
        intensity += s.intensity;
        spread += s.spread;
        emission = std::max(emission, s.emission);
        isTwoSided |= s.isTwoSided;
        count += s.count;
    }
    float cost() const {
        if (count == 0)
            return 0;
        const float diagonal2 = (length2(begin.size()) + length2(end.size())) / 2;
        const float meanSpread = spread / intensity;
        const auto deviation = [&] { return std::acos(std::clamp(length(axes) / intensity, 0.f, 1.f)); };
        const float cone = meanSpread >= kPi ? kPi : std::min(meanSpread + 1.5f * deviation(), kPi);
        return intensity * diagonal2 * orientationMeasure(cone, emission) * (isTwoSided ? 2.f : 1.f);
    }
};

using Range = std::span<TreeEmitter>;

struct Split {
    float cost = kInfinity;
    int axis = -1;
    float position = 0;
};

/// Finds the best of the planes between bins along an axis.
void tryAxis(Range range, int axis, Split& best) {
    constexpr int kMaxBins = 16;
    const int bins = int(std::min<size_t>(range.size(), kMaxBins));
    float low = kInfinity, high = -kInfinity;
    for (const TreeEmitter& e : range) {
        const float x = coordinate(e.bounds, axis);
        low = std::min(low, x);
        high = std::max(high, x);
    }
    const float scale = float(bins) / (high - low);
    if (!(high > low) || !std::isfinite(scale))
        return;
    ClusterSums sums[kMaxBins];
    for (const TreeEmitter& e : range)
        sums[std::min(int((coordinate(e.bounds, axis) - low) * scale), bins - 1)].add(e.bounds);
    float costAbove[kMaxBins];
    ClusterSums above, below;
    for (int i = bins - 1; i > 0; --i) {
        above.add(sums[i]);
        costAbove[i] = above.count > 0 ? above.cost() : kInfinity;
    }
    for (int i = 1; i < bins; ++i) {
        below.add(sums[i - 1]);
        const float cost = below.cost() + costAbove[i];
        if (below.count > 0 && cost < best.cost)
            best = {cost, axis, low + float(i) / scale};
    }
}

/// Returns the coordinate in which velocities differ most.
int widestVelocity(Range range) {
    Box3f box;
    for (const TreeEmitter& e : range)
        box.extendBy(e.bounds.end - e.bounds.begin);
    return int(box.majorAxis());
}

/// Returns the number of emitters in the first of two parts of the range. Orders the range accordingly.
/// `axes`: number of the axes that are tried; 0: splits the range in halves. Of the axes of velocity, only
/// the one of largest extent is tried.
size_t splitRange(Range range, int axes) {
    if (range.size() == 2)
        return 1;
    Split best;
    for (int axis = 0; axis < std::min(axes, kPositionAxes); ++axis)
        tryAxis(range, axis, best);
    if (axes > kPositionAxes)
        tryAxis(range, kPositionAxes + widestVelocity(range), best);
    size_t count = 0;
    if (best.axis >= 0) {
        const auto end = std::partition(range.begin(), range.end(), [&](const TreeEmitter& e) {
            return coordinate(e.bounds, best.axis) < best.position;
        });
        count = size_t(end - range.begin());
    }
    return count > 0 && count < range.size() ? count : range.size() / 2;
}

float costOf(Range range) {
    ClusterSums sums;
    for (const TreeEmitter& e : range)
        sums.add(e.bounds);
    return sums.cost();
}

/// Returns bounds of all emitters of a range.
EmitterBounds boundRange(Range range) {
    if (range.size() == 1)
        return range.front().bounds;
    Box3f begin, end;
    EmitterBounds all;
    V3f axes(0);
    all.emission = 0;
    for (const TreeEmitter& e : range) {
        const V3f r(e.bounds.radius);
        begin.extendBy(Box3f(e.bounds.begin - r, e.bounds.begin + r));
        end.extendBy(Box3f(e.bounds.end - r, e.bounds.end + r));
        axes += e.bounds.axis * e.bounds.intensity;
        all.emission = std::max(all.emission, e.bounds.emission);
        all.isTwoSided |= e.bounds.isTwoSided;
    }
    all.begin = begin.center();
    all.end = end.center();
    all.axis = normalizeAny(axes);
    all.spread = all.axis == V3f(0) ? kPi : 0;
    double intensity = 0;
    for (const TreeEmitter& e : range) {
        const EmitterBounds& b = e.bounds;
        all.radius = std::max(all.radius, length(b.begin - all.begin) + b.radius);
        all.radius = std::max(all.radius, length(b.end - all.end) + b.radius);
        if (all.spread < kPi)
            all.spread = std::min(
                kPi, std::max(all.spread, b.spread >= kPi ? kPi : angleBetween(b.axis, all.axis) + b.spread));
        intensity += double(b.intensity);
    }
    all.radius *= 1 + 1e-5f;
    all.intensity = float(intensity);
    return all;
}

/// The part of treeCost of a node's child.
double boundsCost(float intensity, float radius, float spread, float emission) {
    return double(intensity * sqr(radius)) * double(orientationMeasure(spread, emission));
}

class TreeBuilder {
  public:
    TreeBuilder(size_t emitterCount, bool isMoving) : m_isMoving(isMoving) {
        m_tree.slots.assign(emitterCount, LightSubtree::kNoSlot);
    }
    LightSubtree takeTree() { return std::move(m_tree); }

    uint32_t addNode(uint32_t parent) {
        m_tree.nodes.emplace_back();
        m_tree.parents.push_back(parent);
        if (m_isMoving)
            m_tree.motions.emplace_back();
        return uint32_t(m_tree.nodes.size() - 1);
    }

    void setChild(uint32_t index, int slot, const EmitterBounds& b) {
        LightNode& node = m_tree.nodes[index];
        const V3f start = m_isMoving ? b.begin : (b.begin + b.end) * .5f;
        node.x[slot] = start.x;
        node.y[slot] = start.y;
        node.z[slot] = start.z;
        node.radius[slot] = b.isTwoSided ? -b.radius : b.radius;
        node.axisX[slot] = b.axis.x;
        node.axisY[slot] = b.axis.y;
        node.axisZ[slot] = b.axis.z;
        node.cosSpread[slot] = b.spread >= kPi ? -1 : std::cos(b.spread);
        node.sinSpread[slot] = b.spread >= kPi ? 0 : std::sin(b.spread);
        node.cosEmission[slot] = std::cos(std::min(b.emission, kPi));
        m_tree.isOriented |= b.spread < kPi;
        node.intensity[slot] = b.intensity;
        if (!m_isMoving)
            return;
        LightNodeMotion& motion = m_tree.motions[index];
        motion.x[slot] = b.end.x - b.begin.x;
        motion.y[slot] = b.end.y - b.begin.y;
        motion.z[slot] = b.end.z - b.begin.z;
    }

    void setLeaf(uint32_t node, int slot, const TreeEmitter& emitter) {
        setChild(node, slot, emitter.bounds);
        m_tree.nodes[node].child[slot] = LightNode::kLeaf | uint32_t(m_tree.leaves.size());
        m_tree.slots[emitter.index] = node * LightNode::kWidth + uint32_t(slot);
        m_tree.leaves.push_back(emitter.index);
    }

    /// Builds the node of a range and, recursively, its children.
    void build(Range range, uint32_t parent, int depth = 0) {
        constexpr int kMaxSplitDepth = 48; // halves then end below LightSubtree::kMaxLevels
        const uint32_t index = addNode(parent);
        Range children[LightNode::kWidth];
        const int axes = depth > kMaxSplitDepth ? 0 : m_isMoving ? kMaxAxes : kPositionAxes;
        const int count = splitInto(range, axes, children);
        for (int slot = 0; slot < count; ++slot) {
            if (children[slot].size() == 1) {
                setLeaf(index, slot, children[slot].front());
                continue;
            }
            setChild(index, slot, boundRange(children[slot]));
            m_tree.nodes[index].child[slot] = uint32_t(m_tree.nodes.size());
            build(children[slot], index * LightNode::kWidth + uint32_t(slot), depth + 1);
        }
    }

  private:
    /// Splits the parts of largest cost until there are eight, or none is worth it. Returns their number.
    /// Parts that fit into a node are split only if the range itself does, so that few slots remain empty.
    static int splitInto(Range range, int axes, Range* parts) {
        float costs[LightNode::kWidth];
        int count = 1;
        parts[0] = range;
        const size_t whole = range.size() > LightNode::kWidth ? LightNode::kWidth : 1;
        const auto cost = [&](Range part) { return part.size() > whole ? costOf(part) : -1; };
        costs[0] = cost(range);
        while (count < LightNode::kWidth) {
            const int worst = int(std::max_element(costs, costs + count) - costs);
            if (costs[worst] < 0)
                break;
            const size_t first = splitRange(parts[worst], axes);
            parts[count] = parts[worst].subspan(first);
            parts[worst] = parts[worst].first(first);
            for (const int part : {worst, count})
                costs[part] = cost(parts[part]);
            ++count;
        }
        return count;
    }

    const bool m_isMoving;
    LightSubtree m_tree;
};

void removeBlack(std::vector<TreeEmitter>& emitters) {
    std::erase_if(emitters, [](const TreeEmitter& e) { return !(e.bounds.intensity > 0); });
}

} // namespace

LightSubtree buildLightTree(std::vector<TreeEmitter> emitters, size_t emitterCount, bool isMoving) {
    removeBlack(emitters);
    TreeBuilder builder(emitterCount, isMoving);
    if (!emitters.empty())
        builder.build(emitters, 0);
    return builder.takeTree();
}

LightSubtree listEmitters(std::vector<TreeEmitter> emitters, size_t emitterCount, bool isMoving) {
    removeBlack(emitters);
    TreeBuilder builder(emitterCount, isMoving);
    uint32_t node = 0;
    for (size_t i = 0; i < emitters.size(); ++i) {
        const int slot = int(i % LightNode::kWidth);
        if (slot == 0)
            node = builder.addNode(0);
        builder.setLeaf(node, slot, emitters[i]);
    }
    return builder.takeTree();
}

double treeCost(const LightSubtree& tree) {
    double cost = 0;
    for (const LightNode& node : tree.nodes)
        for (int i = 0; i < LightNode::kWidth; ++i) {
            const float spread = std::acos(std::clamp(node.cosSpread[i], -1.f, 1.f));
            cost += boundsCost(node.intensity[i], node.radius[i], spread, std::acos(node.cosEmission[i]));
        }
    return cost;
}

double treeCost(const LightSubtree& tree, std::span<TreeEmitter> emitters) {
    double cost = 0;
    size_t leafCount = 0; // the leaves below a node follow each other
    const auto addNode = [&](uint32_t index, const auto& addChild) -> void {
        for (int i = 0; i < LightNode::kWidth && tree.nodes[index].intensity[i] > 0; ++i) {
            const size_t first = leafCount;
            const uint32_t child = tree.nodes[index].child[i];
            if (child & LightNode::kLeaf)
                ++leafCount;
            else
                addChild(child, addChild);
            const EmitterBounds b = boundRange(emitters.subspan(first, leafCount - first));
            cost += boundsCost(b.intensity, b.radius, b.spread, b.emission);
        }
    };
    if (!tree.nodes.empty())
        addNode(0, addNode);
    return cost;
}

} // namespace strobe
