// The footprints of texture lookups, and the MIP levels and probes that filter them.
#pragma once

#include "core/image/texture_cache.h"

namespace strobe {

inline constexpr int kMaxProbes = 64; ///< maximum number of probes along an ellipse

/// The ellipses of lookups, and their levels and probes.
struct MipFootprints {
    alignas(64) float major[kSoAWidth], minor[kSoAWidth], aspect[kSoAWidth]; ///< after limitAspect
    V2SoA direction;
    alignas(64) int32_t
        isSubTexel[kSoAWidth]; ///< the ellipse is shorter than half a texel of the finest level
    /// The finest level where the ellipse is no wider than a texel. It is blended with the next finer level.
    alignas(64) int32_t level[kSoAWidth];
    alignas(64) int32_t isWider[kSoAWidth]; ///< the ellipse is wider than a texel in all levels tested so far
    V2SoA half;                             ///< the probes extend from uv - half to uv + half
    alignas(64) int32_t probes[kSoAWidth];  ///< number of probes
    alignas(64) int32_t finer[kSoAWidth];   ///< the finer one of the two levels
    alignas(64) float steepness[kSoAWidth]; ///< probes have weights exp(steepness x²), for x in [-1,1] along
                                            ///< the line
    alignas(64) float blend[kSoAWidth];     ///< weight of the coarser level

    /// Computes the ellipses, and sets isDone to 0 where they or the coordinates are too large. `side` is the
    /// longer side of the finest level in texels.
    static void measure(const TexturePointSoA& points, int begin, int end, float side, int32_t* isDone,
                        MipFootprints& f);
    /// Computes `level` from the shorter sides of all levels.
    static void findLevels(const float* shorterSide, int levels, int begin, int end, MipFootprints& f);
    /// Computes the remaining members.
    static void findProbes(const float* shorterSide, int levels, float side, int begin, int end,
                           MipFootprints& f);
};

} // namespace strobe
