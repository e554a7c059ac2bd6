// The choice of a light by its estimated irradiance at a point: a tree of lights.
#pragma once

#include "core/interfaces/light.h"
#include "core/math/api.h"
#include "core/scene/light_tree_nodes.h"

#include <memory>
#include <span>
#include <vector>

namespace STROBE_API strobe {

/// The bounds of moving lights in a light tree.
enum class LightMotion {
    Swept,  ///< bounds of the whole shutter
    Linear, ///< bounds that move linearly while the shutter is open
    Split,  ///< as Linear, with trees of their own for intervals of the shutter where this tightens bounds
};

struct LightTreeSettings {
    bool isExhaustive = false; ///< no tree: computes the importance of all emitters at each point
    LightMotion motion = LightMotion::Split;
    bool operator==(const LightTreeSettings&) const = default;
};

/// The arguments of LightTree::pick, one element per sample.
struct LightPickQuery {
    const V3SoA& p;            ///< shaded points, world space
    const V3SoA &ng, &ns;      ///< unit geometric and shading normals, in one hemisphere
    const float* cosWo;        ///< dot(wo, ng): its sign tells the viewer's side
    const float* transmissive; ///< not 0: light from behind the surface counts, too
    const float* time;         ///< shutter fractions
    const float *u, *uFine;    ///< independent random numbers in [0,1), multiples of 2^-24
    int n;                     ///< number of samples, at most kSoAWidth
    int samplesPerPoint = 1;   ///< number of consecutive samples with the same point and time
};
/// The emitters that LightTree::pick chose.
struct LightPickSoA {
    int light[kSoAWidth];
    uint32_t emitter[kSoAWidth];  ///< argument of Light::sampleEmitter
    float probability[kSoAWidth]; ///< of the choice
};

/// Chooses emitters (see Light::emitterCount) with probabilities that follow their estimated irradiance at a
/// point (Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018;
/// pbrt-v4, section 12.6.3). Nodes have eight children, among which a child is chosen by importance. Lights
/// without bounds (at infinity) are chosen beside the tree: half by their share of the irradiance, half
/// uniformly, the tree counting as one light. The sum of all probabilities at a point is 1. Immutable; all
/// functions are thread-safe and their results do not depend on threads.
class LightTree {
  public:
    /// `radius`: of the scene's bounding sphere.
    LightTree(std::span<const std::shared_ptr<const Light>> lights, float radius,
              const LightTreeSettings& settings = {});

    /// Returns true if all emitters are black, so that none can be chosen.
    bool isEmpty() const { return m_subtrees.front().nodes.empty() && m_unbounded.empty(); }
    /// Chooses an emitter for each sample. Precondition: the tree is not empty.
    void pick(const LightPickQuery& query, LightPickSoA& out) const;
    /// Returns the probability with which `pick` chooses a light at a point, or, if it is a mesh with several
    /// emitters, triangle `prim` of the light.
    float probability(const LightPoint& point, int light, uint32_t prim) const;
    /// Returns the emitter that contains triangle `prim` of a light.
    uint32_t emitterOf(int light, uint32_t prim) const {
        return m_firstEmitter[size_t(light) + 1] - m_firstEmitter[size_t(light)] > 1 ? prim : 0;
    }
    /// Returns false only if no light, other than delta lights, may subtend `solidAngle` or more at p. A
    /// conservative test.
    bool maySubtend(const V3f& p, float time, float solidAngle) const;

    /// Returns the number of emitters of all lights.
    size_t emitterCount() const { return m_lightOf.size(); }
    /// Returns the number of intervals of the shutter that have a tree of their own.
    size_t intervalCount() const { return m_subtrees.size(); }
    /// Returns the bytes that the tree occupies.
    size_t bytes() const;

    /// A choice of pick.
    struct Choice {
        uint32_t emitter; ///< of all emitters of the scene
        float probability;
    };

  private:
    void buildSubtrees(std::span<const std::shared_ptr<const Light>> lights, LightMotion motion);
    double costAtMiddle(std::span<const std::shared_ptr<const Light>> lights) const;
    LightSubtree makeSubtree(std::span<const std::shared_ptr<const Light>> lights, float begin, float end,
                             bool isMoving);

    bool m_isExhaustive;
    bool m_hasEnvironment = false;
    float m_maxRadius = 0;                ///< of lights that are not delta lights
    std::vector<uint32_t> m_firstEmitter; ///< by light, and the total
    std::vector<uint32_t> m_lightOf;      ///< by emitter
    std::vector<LightSubtree> m_subtrees; ///< by interval of the shutter, of equal lengths
    std::vector<uint32_t> m_unbounded;    ///< emitters of the lights without bounds, ascending
    std::vector<float> m_unboundedCdf;    ///< ends of their intervals of [0,1)
    float m_unboundedIrradiance = 0;      ///< sum over the lights without bounds
};

} // namespace strobe
