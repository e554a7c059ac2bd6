// What the path shader keeps of a path under way.
#pragma once

#include "core/render/shader.h"
#include "core/scene/scene.h"

namespace strobe {

struct ShadeSettings {
    bool path;
    int maxDepth;
    bool allLights;
    int lightSamples; ///< 0: each light's own number

    int samplesOf(const Light& light) const { return lightSamples ? lightSamples : light.sampleCount; }
};

/// Light sampling alone is used where the BSDF's density times the light's solid angle is less than this: the
/// other strategy's share of the power heuristic would be below its square, so its samples and rays are not
/// worth making.
constexpr float kNegligibleBsdfShare = 0.05f;
inline bool bsdfSamplingCounts(float maxPdf, float solidAngle) {
    return !(maxPdf * solidAngle < kNegligibleBsdfShare);
}
constexpr int kRouletteFrom = 3;

// Random dimensions of one path vertex.
enum : uint32_t { kDimDirection = 0, kDimLobe = 1, kDimRoulette = 2, kDimPick = 3, kDimLights = 8 };
constexpr uint32_t kFirstDimension = 16, kDimensionsPerVertex = 1u << 20, kDimensionsPerLight = 4;

/// What a path's ray left: the eye, or mirrors and glass that it sees; the first other surface; or what is
/// beyond.
enum class PathStage : uint8_t { Camera, FirstHit, Indirect };

/// One path under way.
struct Path {
    Hit hit;
    Ray ray;
    RayCone cone;
    Rgb beta, radiance;
    Rgb viaBsdf; ///< this wave's sum of one of two ray queues: added later, so that their order never matters
    uint64_t domain;
    uint32_t index, total;
    LightComponent component;
    // How the ray was made, to weight the light it may hit:
    bool specularBounce; ///< camera rays and delta lobes: no other strategy could have found the light
    PathStage stage;
    bool lightIsDirect; ///< that of samples of lights at this wave's vertex
    bool fromAllLights; ///< light sampling there took every light, not one
    float pdf, maxPdf;
    V3f from;

    /// But for the hit. Number by number: the processor waits where it reads as one what it has just written
    /// in pieces.
    void start(const RequestSoA& r, int i) {
        ray.o.x = r.ray.o.x[i], ray.o.y = r.ray.o.y[i], ray.o.z = r.ray.o.z[i];
        ray.d.x = r.ray.d.x[i], ray.d.y = r.ray.d.y[i], ray.d.z = r.ray.d.z[i];
        ray.time = r.time[i], ray.tmin = 0;
        cone.width = r.width[i], cone.spread = r.spread[i];
        beta = Rgb(1), radiance = viaBsdf = Rgb(0);
        domain = r.domain[i], index = r.index[i], total = r.total[i], component = r.component[i];
        specularBounce = lightIsDirect = true, fromAllLights = false, stage = PathStage::Camera;
        pdf = maxPdf = 0, from = V3f(0);
    }
};

/// A BSDF sample on its way to a light, in direct lighting.
struct LightProbe {
    uint32_t path;
    int light;
    float pdf; ///< of the BSDF; both strategies draw equally many samples
    V3f from, wi;
    float time;
    Rgb weight; ///< beta f cos / (n pdf)
};

} // namespace strobe
