#include "core/scene/light_tree.h"

#include "core/math/sampling.h"
#include "core/scene/light_tree_builder.h"
#include "core/scene/light_tree_walk.h"

#include <algorithm>

namespace strobe {

namespace {

constexpr int kWidth = LightNode::kWidth;
constexpr int kSampleBits = 16; ///< of the keys by which samples are sorted

/// The tables from which an emitter is chosen. They belong to a LightTree.
struct TreeView {
    const LightSubtree* subtrees;
    int subtreeCount;
    bool isExhaustive;
    const uint32_t* unbounded;
    const float* unboundedCdf;
    int unboundedCount;
    float unboundedIrradiance;
};

/// Returns the importance of all emitters: the sum over the children of the root, or over all emitters.
STROBE_FORCE_INLINE double importanceOfAll(const LightSubtree& tree, bool isExhaustive, float fraction,
                                           const LightPoint& point) {
    double sum = 0;
    const size_t count = isExhaustive ? tree.nodes.size() : std::min<size_t>(tree.nodes.size(), 1);
    for (size_t index = 0; index < count; ++index) {
        float importance[kWidth];
        computeImportances(tree, uint32_t(index), fraction, point, importance);
        for (int i = 0; i < kWidth; ++i)
            sum += double(importance[i]);
    }
    return sum;
}

/// Returns the probability of the tree beside the lights without bounds.
STROBE_FORCE_INLINE float treeProbability(const TreeView& view, double importance) {
    if (view.unboundedCount == 0)
        return 1;
    if (!(importance > 0))
        return 0;
    return .5f / float(1 + view.unboundedCount) +
           .5f * float(importance / (importance + double(view.unboundedIrradiance)));
}

STROBE_FORCE_INLINE const LightSubtree& subtreeOf(const TreeView& view, float time, float& fraction) {
    const float x = std::clamp(time, 0.f, 1.f) * float(view.subtreeCount);
    const int index = std::min(int(x), view.subtreeCount - 1);
    fraction = x - float(index);
    return view.subtrees[index];
}

/// Chooses among all emitters.
STROBE_FORCE_INLINE LightTree::Choice chooseExhaustively(const LightSubtree& tree, float fraction,
                                                         const LightPoint& point, double u, double sum,
                                                         float probability) {
    double begin = 0;
    LightTree::Choice last{0, 0};
    for (uint32_t index = 0; index < tree.nodes.size(); ++index) {
        float importance[kWidth];
        const LightNode& node = computeImportances(tree, index, fraction, point, importance);
        for (int i = 0; i < kWidth; ++i) {
            const double weight = double(sum > 0 ? importance[i] : node.intensity[i]);
            if (!(weight > 0))
                continue;
            last = {tree.leaves[node.child[i] & ~LightNode::kLeaf], float(weight)};
            begin += weight;
            if (begin > u)
                return {last.emitter, probability * last.probability};
        }
    }
    return {last.emitter, probability * last.probability}; // u was rounded up
}

double totalIntensity(const LightSubtree& tree) {
    double sum = 0;
    for (const LightNode& node : tree.nodes)
        for (int i = 0; i < kWidth; ++i)
            sum += double(node.intensity[i]);
    return sum;
}

/// Chooses among the lights without bounds. `u`: in [0,1).
LightTree::Choice chooseUnbounded(const TreeView& view, float u, float probability) {
    int index = 0;
    while (index + 1 < view.unboundedCount && view.unboundedCdf[index] <= u)
        ++index;
    const float begin = index > 0 ? view.unboundedCdf[index - 1] : 0;
    return {view.unbounded[index], probability * (view.unboundedCdf[index] - begin)};
}

STROBE_FORCE_INLINE LightPoint pointOf(const LightPickQuery& q, int i) {
    const float side = q.cosWo[i] < 0 ? -1.f : 1.f;
    return {q.p.at(i), q.ng.at(i) * side, q.ns.at(i) * side, q.transmissive[i] != 0, q.time[i]};
}

/// Chooses for the samples of a point. `keys`: 48 bits of their random numbers and kSampleBits of their
/// indices, ascending. Samples that the tree chooses for are added to `walks`.
STROBE_FORCE_INLINE void chooseAtPoint(const TreeView& view, const LightTreePoint& point,
                                       std::span<const uint64_t> keys, LightTreeWalks& walks,
                                       LightTree::Choice* choices) {
    const LightSubtree& tree = *point.tree;
    const bool needsSum = view.unboundedCount > 0 || view.isExhaustive;
    const double sum = needsSum ? importanceOfAll(tree, view.isExhaustive, point.fraction, point.point) : 1;
    const float inTree = tree.nodes.empty() ? 0 : treeProbability(view, sum);
    const double total = sum > 0 || !view.isExhaustive ? sum : totalIntensity(tree);
    for (const uint64_t key : keys) {
        const double u = double(int64_t(key >> kSampleBits)) * 0x1p-48;
        const auto sample = int(key & ((1u << kSampleBits) - 1));
        if (u >= double(inTree) && view.unboundedCount > 0) {
            const auto rest = float((u - double(inTree)) / double(1 - inTree));
            choices[sample] = chooseUnbounded(view, std::min(rest, kOneMinusEpsilon), 1 - inTree);
            continue;
        }
        const double inside = std::min(u / double(inTree), kDoubleOneMinusEpsilon);
        if (view.isExhaustive) {
            const LightTree::Choice choice =
                chooseExhaustively(tree, point.fraction, point.point, inside * total, sum, inTree);
            choices[sample] = {choice.emitter, float(double(choice.probability) / total)};
            continue;
        }
        walks.add(point, inTree, inside, sample);
    }
}

/// Sorts at most kSoAWidth different keys by counting those that are smaller, which takes no branches.
STROBE_FORCE_INLINE void sortKeys(uint64_t* keys, int count) {
    uint64_t sorted[kSoAWidth];
    for (int i = 0; i < count; ++i) {
        const uint64_t key = keys[i];
        uint64_t rank = 0;
        for (int k = 0; k < count; ++k)
            rank += keys[k] < key ? 1 : 0;
        sorted[rank] = key;
    }
    std::copy_n(sorted, count, keys);
}

STROBE_TARGET_CLONES void chooseAll(const TreeView& view, const LightPickQuery& q,
                                    LightTree::Choice* choices) {
    LightTreePoint points[kSoAWidth];
    LightTreeWalks walks;
    uint64_t keys[kSoAWidth];
    for (int i = 0; i < q.n; ++i) {
        const auto fixed = [](float u) { return uint64_t(int64_t(u * 0x1p24f)); };
        keys[i] = ((fixed(q.u[i]) << 24 | fixed(q.uFine[i])) << kSampleBits) + uint64_t(i);
    }
    for (int first = 0, k = 0; first < q.n; first += q.samplesPerPoint, ++k) {
        const int count = std::min(q.samplesPerPoint, q.n - first);
        LightTreePoint& point = points[k];
        point.point = pointOf(q, first);
        point.tree = &subtreeOf(view, point.point.time, point.fraction);
        sortKeys(keys + first, count);
        chooseAtPoint(view, point, std::span(keys).subspan(size_t(first), size_t(count)), walks, choices);
    }
    walks.finish(choices);
}

/// Returns the probability of the slot of an emitter, by the path from the root.
STROBE_TARGET_CLONES float slotProbability(const TreeView& view, const LightPoint& point, uint32_t emitter) {
    float fraction;
    const LightSubtree& tree = subtreeOf(view, point.time, fraction);
    const uint32_t slot = tree.slots[emitter];
    if (slot == LightSubtree::kNoSlot)
        return 0;
    const bool needsSum = view.unboundedCount > 0 || view.isExhaustive;
    const double sum = needsSum ? importanceOfAll(tree, view.isExhaustive, fraction, point) : 1;
    float probability = treeProbability(view, sum);
    if (view.isExhaustive) {
        float importance[kWidth];
        const LightNode& node = computeImportances(tree, slot / kWidth, fraction, point, importance);
        const double weight = double(sum > 0 ? importance[slot % kWidth] : node.intensity[slot % kWidth]);
        return float(double(probability * float(weight)) / (sum > 0 ? sum : totalIntensity(tree)));
    }
    uint32_t path[LightSubtree::kMaxLevels];
    int depth = 0;
    for (uint32_t s = slot;; s = tree.parents[s / kWidth]) {
        path[depth++] = s;
        if (s / kWidth == 0)
            break;
    }
    while (depth-- > 0) { // the order of LightTreeWalks, for the same bits
        EvaluatedLightNode e;
        evaluateNode(tree, path[depth] / kWidth, fraction, point, e);
        probability *= float(double(e.importance[path[depth] % kWidth]) / e.sum());
    }
    return probability;
}

/// Returns the irradiance of a light without bounds: exact for a distant light that a surface faces.
float irradianceOf(const Light& light, float radius) {
    const float irradiance = rootMeanSquare(light.power(radius)) / (kPi * sqr(radius));
    return irradiance > 0 && std::isfinite(irradiance) ? irradiance : 0;
}

} // namespace

LightTree::LightTree(std::span<const std::shared_ptr<const Light>> lights, float radius,
                     const LightTreeSettings& settings)
    : m_isExhaustive(settings.isExhaustive), m_firstEmitter(1, 0) {
    std::vector<float> shares;
    for (const auto& light : lights) {
        const uint32_t first = m_firstEmitter.back();
        m_firstEmitter.push_back(first + light->emitterCount());
        m_lightOf.resize(m_firstEmitter.back(), uint32_t(m_firstEmitter.size() - 2));
        m_hasEnvironment |= light->isEnvironment();
        if (light->emitterCount() > 0 && !light->emitterBounds(0, 0, 1))
            if (const float irradiance = irradianceOf(*light, radius); irradiance > 0) {
                m_unbounded.push_back(first);
                shares.push_back(irradiance);
                m_unboundedIrradiance += irradiance;
            }
    }
    float cumulative = 0;
    for (const float share : shares) {
        cumulative += .5f / float(shares.size()) + .5f * share / m_unboundedIrradiance;
        m_unboundedCdf.push_back(cumulative);
    }
    if (!m_unboundedCdf.empty())
        m_unboundedCdf.back() = 1;
    buildSubtrees(lights, settings.motion);
}

/// Builds the trees of the shutter's intervals.
void LightTree::buildSubtrees(std::span<const std::shared_ptr<const Light>> lights, LightMotion motion) {
    constexpr int kMaxIntervals = 16, kRefinement = 4;
    constexpr double kMinGain = .8; // of the costs, for four times as many intervals
    m_subtrees.push_back(makeSubtree(lights, 0, 1, motion != LightMotion::Swept));
    if (motion != LightMotion::Split || m_isExhaustive || m_subtrees[0].motions.empty())
        return;
    double cost = treeCost(m_subtrees[0]);
    if (!(costAtMiddle(lights) < kMinGain * cost))
        return; // the bounds do not widen with time: lights move together
    for (int count = kRefinement; count <= kMaxIntervals; count *= kRefinement) {
        std::vector<LightSubtree> finer;
        double finerCost = 0;
        for (int i = 0; i < count; ++i) {
            finer.push_back(makeSubtree(lights, float(i) / float(count), float(i + 1) / float(count), true));
            finerCost += treeCost(finer.back()) / count;
        }
        if (!(finerCost < kMinGain * cost))
            break;
        cost = finerCost;
        m_subtrees = std::move(finer);
    }
}

/// Returns the cost that the tree of the whole shutter has with bounds of the middle of the shutter.
double LightTree::costAtMiddle(std::span<const std::shared_ptr<const Light>> lights) const {
    std::vector<TreeEmitter> emitters;
    for (const uint32_t index : m_subtrees[0].leaves) {
        const uint32_t light = m_lightOf[index];
        emitters.push_back({*lights[light]->emitterBounds(index - m_firstEmitter[light], .5f, .5f), index});
    }
    return treeCost(m_subtrees[0], emitters);
}

/// Builds the tree of an interval of shutter fractions. `isMoving`: the bounds move, if any light does.
LightSubtree LightTree::makeSubtree(std::span<const std::shared_ptr<const Light>> lights, float begin,
                                    float end, bool isMoving) {
    std::vector<TreeEmitter> emitters;
    bool moves = false;
    for (size_t i = 0; i < lights.size(); ++i) {
        Box3f box;
        for (uint32_t emitter = 0; emitter < lights[i]->emitterCount(); ++emitter) {
            const auto bounds = lights[i]->emitterBounds(emitter, begin, end);
            if (!bounds)
                continue;
            emitters.push_back({*bounds, m_firstEmitter[i] + emitter});
            moves |= bounds->begin != bounds->end;
            const V3f r(bounds->radius);
            box.extendBy(Box3f(bounds->begin - r, bounds->begin + r));
            box.extendBy(Box3f(bounds->end - r, bounds->end + r));
        }
        if (!lights[i]->isDelta() && !box.isEmpty())
            m_maxRadius = std::max(m_maxRadius, length(box.size()) / 2);
    }
    if (moves && !isMoving)
        for (TreeEmitter& e : emitters) {
            EmitterBounds& b = e.bounds;
            b.radius += length(b.end - b.begin) / 2;
            b.begin = b.end = (b.begin + b.end) * .5f;
        }
    const auto build = m_isExhaustive ? listEmitters : buildLightTree;
    return build(std::move(emitters), m_lightOf.size(), moves && isMoving);
}

namespace {

TreeView viewOf(const std::vector<LightSubtree>& subtrees, bool isExhaustive,
                const std::vector<uint32_t>& unbounded, const std::vector<float>& cdf, float irradiance) {
    return {subtrees.data(), int(subtrees.size()),  isExhaustive, unbounded.data(),
            cdf.data(),      int(unbounded.size()), irradiance};
}

} // namespace

void LightTree::pick(const LightPickQuery& query, LightPickSoA& out) const {
    Choice choices[kSoAWidth];
    chooseAll(viewOf(m_subtrees, m_isExhaustive, m_unbounded, m_unboundedCdf, m_unboundedIrradiance), query,
              choices);
    for (int i = 0; i < query.n; ++i) {
        const uint32_t light = m_lightOf[choices[i].emitter];
        out.light[i] = int(light);
        out.emitter[i] = choices[i].emitter - m_firstEmitter[light];
        out.probability[i] = choices[i].probability;
    }
}

float LightTree::probability(const LightPoint& point, int light, uint32_t prim) const {
    const TreeView view =
        viewOf(m_subtrees, m_isExhaustive, m_unbounded, m_unboundedCdf, m_unboundedIrradiance);
    const uint32_t emitter = m_firstEmitter[size_t(light)] + emitterOf(light, prim);
    const auto i = std::lower_bound(m_unbounded.begin(), m_unbounded.end(), emitter);
    if (i == m_unbounded.end() || *i != emitter)
        return slotProbability(view, point, emitter);
    const size_t index = size_t(i - m_unbounded.begin());
    float fraction;
    const LightSubtree& tree = subtreeOf(view, point.time, fraction);
    const double sum = importanceOfAll(tree, m_isExhaustive, fraction, point);
    const float inTree = tree.nodes.empty() ? 0 : treeProbability(view, sum);
    return (1 - inTree) * (m_unboundedCdf[index] - (index > 0 ? m_unboundedCdf[index - 1] : 0));
}

bool LightTree::maySubtend(const V3f& p, float time, float solidAngle) const {
    if (m_hasEnvironment)
        return true;
    if (!(m_maxRadius > 0))
        return false;
    const float cosine = 1 - solidAngle / (2 * kPi);
    // A light is nearer than `limit` if it subtends the angle; its emitters lie within two radii of its
    // center.
    const float limit = m_maxRadius * (cosine > 0 ? 1 / std::sqrt(std::max(1 - sqr(cosine), 1e-12f)) : 1);
    float fraction;
    const LightSubtree& tree =
        subtreeOf(viewOf(m_subtrees, m_isExhaustive, m_unbounded, m_unboundedCdf, 0), time, fraction);
    std::vector<uint32_t> stack;
    if (!tree.nodes.empty())
        stack.push_back(0);
    while (!stack.empty()) {
        const uint32_t index = stack.back();
        stack.pop_back();
        const LightNode& node = tree.nodes[index];
        for (int i = 0; i < kWidth; ++i) {
            V3f center(node.x[i], node.y[i], node.z[i]);
            if (!tree.motions.empty())
                center += V3f(tree.motions[index].x[i], tree.motions[index].y[i], tree.motions[index].z[i]) *
                          fraction;
            const float reach = limit + 2 * m_maxRadius + std::abs(node.radius[i]);
            if (!(node.intensity[i] > 0) || length2(center - p) > sqr(reach))
                continue;
            if (node.child[i] & LightNode::kLeaf)
                return true;
            stack.push_back(node.child[i]);
        }
        if (m_isExhaustive && index + 1 < tree.nodes.size())
            stack.push_back(index + 1);
    }
    return false;
}

size_t LightTree::bytes() const {
    size_t sum = (m_firstEmitter.size() + m_lightOf.size()) * sizeof(uint32_t);
    for (const LightSubtree& tree : m_subtrees)
        sum += tree.nodes.size() * sizeof(LightNode) + tree.motions.size() * sizeof(LightNodeMotion) +
               (tree.parents.size() + tree.leaves.size() + tree.slots.size()) * sizeof(uint32_t);
    return sum;
}

} // namespace strobe
