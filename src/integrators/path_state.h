// What the path shader keeps of a path under way.
#pragma once

#include "core/integrator.h"

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
constexpr int kRouletteFrom = 3;

// Random dimensions of one path vertex.
enum : uint32_t { kDimDirection = 0, kDimLobe = 1, kDimRoulette = 2, kDimPick = 3, kDimLights = 8 };
constexpr uint32_t kFirstDimension = 16, kDimensionsPerVertex = 1u << 20, kDimensionsPerLight = 4;

/// One path under way.
struct Path {
    Hit hit;
    Ray ray;
    RayCone cone;
    Rgb beta{1};
    Rgb radiance{0};
    Rgb direct{0},
        viaBsdf{0}; ///< sums of this wave's two ray queues, kept apart so that their order never matters
    uint64_t domain;
    uint32_t index, total;
    LightPart part = LightPart::All;
    // How the ray was made, to weight the light it may hit:
    bool countsAllLight = true; ///< camera rays and delta lobes: no other strategy could have found the light
    bool firstSmooth = true;    ///< no smooth surface so far
    bool fromAllLights = false; ///< light sampling there took every light, not one
    float pdf = 0, maxPdf = 0;
    V3f from{0};
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
