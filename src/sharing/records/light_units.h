// The light of samples as integers, in the units of the sums that it is added to.
#pragma once

#include "core/math/soa.h"
#include "sharing/records/light_cells.h"

namespace strobe {

/// The light that a shader found for the samples of a chunk.
struct LightSoA {
    RgbSoA radiance, albedo;
    RgbSoA parts[kParts];                      ///< the parts of the light at the first vertex
    alignas(64) float weight[kSoAWidth];       ///< of the pixel filter
    alignas(64) uint32_t hasVertex[kSoAWidth]; ///< whether the path has a first vertex: 0 or 1
};

/// How samples are limited before they are added up.
struct LightLimits {
    float clamp = 0; ///< see RenderSettings
    RareLimits rare;
};

/// The light of the samples of a chunk as integers.
struct LightUnits {
    /// Quantities by sample. Light has the units of FixedPointSum, and is 0 for samples that are special.
    enum Quantity {
        kLight = 0,                       ///< RGB by part: divided by the albedo
        kAlbedo = kLight + 3 * kParts,    ///< RGB: see CellUse
        kCellCount = kAlbedo + 3,         ///< the number of those that cells sum up
        kReflected = kCellCount,          ///< RGB by part: with the albedo, weighted by the pixel filter
        kValue = kReflected + 3 * kParts, ///< the whole radiance: mean of the channels, weighted
        kQuantities,
        kReflectedCount = kQuantities - kReflected
    };
    alignas(64) int64_t of[kQuantities][kSoAWidth];
    // 0 or 1 by sample:
    alignas(64) uint32_t isCounted[kSoAWidth];  ///< the film adds the sample
    alignas(64) uint32_t isRecorded[kSoAWidth]; ///< and it has a first vertex
    alignas(64) uint32_t isSpecial[kSoAWidth];  ///< and it exceeds a limit: to be added by SampleLight
};

/// Writes the light of `count` samples as integers.
void findLightUnits(const LightSoA& light, const LightLimits& limits, int count, LightUnits& out);

/// The light of one sample, as LightUnits holds that of many.
struct SampleLight {
    SampleLight(const LightSoA& light, const LightLimits& limits, int i);
    Rgb light[kParts]; ///< divided by the albedo, below the limit of rare light
    Rgb rare[kParts];  ///< above it
    Rgb albedo;        ///< weighted
    float scale;       ///< of the weight: by clamping
    float value;       ///< the whole radiance: mean of the channels, weighted
};

} // namespace strobe
