// Parameters and random dimensions of the path tracer, and its criterion for multiple importance sampling.
#pragma once

#include "core/interfaces/sampler.h"
#include "core/render/batch.h"
#include "core/scene/scene.h"

namespace strobe {

/// The lights that a vertex samples.
enum class LightStrategy {
    Auto,    ///< All up to kMaxLightsOfAll lights, else Tree
    All,     ///< all lights at the first non-specular vertex, one by power at later vertices
    Power,   ///< one light, chosen by power
    Uniform, ///< one light, all equally likely
    Tree,    ///< emitters chosen by the light tree
};

/// Scenes with more lights use the light tree by default: it is then the faster one at the error that all
/// lights have with one sample per pixel (docs/results/2026-11-many-lights.md).
constexpr size_t kMaxLightsOfAll = 128;
/// The default numbers of emitters that the light tree chooses at the first non-specular vertex. Emitters of
/// one vertex cost less than those of several, but paths also have the noise of indirect light, which only
/// more paths reduce.
constexpr int kTreeSamplesOfPaths = 4, kTreeSamplesOfDirectLight = 16;

/// Parameters of the shaders `path` and `directlighting`.
struct PathSettings {
    bool hasIndirectLight; ///< true: `path`; false: `directlighting`
    int maxDepth;          ///< largest number of vertices of a path
    LightStrategy strategy = LightStrategy::Auto;
    LightTreeSettings tree{}; ///< for LightStrategy::Tree
    /// All: samples per light and vertex; 0: Light::sampleCount. Tree: samples at the first non-specular
    /// vertex; 0: kTreeSamplesOfPaths or kTreeSamplesOfDirectLight.
    int lightSamples;
    /// Vertices where a path passes a transmissive surface that do not count for maxDepth, at most so many.
    int transparentDepth;

    /// Returns the strategy for a scene: never Auto.
    LightStrategy strategyFor(const Scene& scene) const {
        if (strategy != LightStrategy::Auto)
            return strategy;
        return scene.lights().size() > kMaxLightsOfAll ? LightStrategy::Tree : LightStrategy::All;
    }
    /// Returns the number of samples of a light at a vertex that samples all lights.
    int samplesOf(const Light& light) const { return lightSamples ? lightSamples : light.sampleCount; }
    /// Returns true if the first non-specular vertex takes other light samples than later ones.
    bool samplesSeveral() const { return strategy == LightStrategy::All || strategy == LightStrategy::Tree; }
    /// Returns the number of emitters that the light tree chooses at a vertex.
    int treeSamples(bool isFirstVertex) const {
        if (!isFirstVertex)
            return 1;
        if (lightSamples > 0)
            return lightSamples;
        return hasIndirectLight ? kTreeSamplesOfPaths : kTreeSamplesOfDirectLight;
    }
    /// Returns true when a path that estimates `component` ends at its first non-specular vertex. BSDF
    /// samples of lights are then traced as light rays; otherwise, the path's next ray is the BSDF sample.
    bool isDirectOnly(LightComponent component) const {
        return !hasIndirectLight || component == LightComponent::Direct;
    }
    /// Returns true when such a path may pass the vertex by a delta lobe. With indirect light, that light is
    /// part of LightComponent::Indirect.
    bool followsDelta(LightComponent component) const {
        return !hasIndirectLight && component != LightComponent::Indirect;
    }
};

/// The inputs that all paths of a worker share.
struct PathContext {
    const Scene& scene;
    const Sampler& sampler;
    PathSettings settings;            ///< the strategy is not Auto
    const LightSampler& lightSampler; ///< of strategies that sample one light
    const LightTree* lightTree;       ///< null unless the strategy is Tree
};

/// The least product of the BSDF's largest pdf and the light's solid angle for multiple importance sampling.
/// The product is the ratio of that pdf to the pdf of uniform sampling of the light. Below the limit, the
/// power heuristic weights BSDF samples by less than its square, 0.0025: they are not worth their rays, and
/// light samples alone are used.
constexpr float kMinMisPdfRatio = 0.05f;

/// Returns true when light samples are to be combined with BSDF samples. `maxBsdfPdf` is an upper bound of
/// the BSDF's pdf per solid angle, `solidAngle` is an upper bound of the light's solid angle. Returns true
/// for the product of infinity and zero.
inline bool usesMis(float maxBsdfPdf, float solidAngle) {
    return !(maxBsdfPdf * solidAngle < kMinMisPdfRatio);
}

/// The first bounce after which Russian roulette may end a path; the camera ray's vertex is bounce 0.
constexpr int kFirstRouletteBounce = 3;

// Random dimensions. Those below kFirstPathDimension belong to the camera.
constexpr uint32_t kFirstPathDimension = 16, kDimensionsPerVertex = 1u << 20, kDimensionsPerLight = 4;
/// Offsets into the dimensions of a vertex. Lights have kDimensionsPerLight each, from kDimLights.
enum : uint32_t {
    kDimBsdfDirection = 0,      ///< 2D
    kDimBsdfLobe = 1,           ///< 1D
    kDimRoulette = 2,           ///< 1D
    kDimLightSelection = 3,     ///< 1D
    kDimLightSelectionFine = 4, ///< 1D
    kDimTreeLight = 5,          ///< the three dimensions of a light that the light tree chose
    kDimLights = 8,
};
/// Offsets into the dimensions of a light at a vertex.
enum : uint32_t {
    kDimLightSample = 0,       ///< 2D
    kDimLightRayDirection = 1, ///< 2D
    kDimLightRayLobe = 2,      ///< 1D
};

/// Returns the random dimension of `offset` (kDim…) at the vertex of `bounce`.
inline uint32_t vertexDimension(int bounce, uint32_t offset) {
    return kFirstPathDimension + uint32_t(bounce) * kDimensionsPerVertex + offset;
}
/// Returns the first random dimension of a light at the vertex of `bounce`. Lights whose indices are equal
/// modulo kMaxLights share dimensions; a vertex samples few of so many lights.
inline uint32_t lightDimension(int bounce, int light) {
    constexpr uint32_t kMaxLights = (kDimensionsPerVertex - kDimLights) / kDimensionsPerLight;
    return vertexDimension(bounce, kDimLights + kDimensionsPerLight * (uint32_t(light) % kMaxLights));
}

} // namespace strobe
