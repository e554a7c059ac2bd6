// Bounds of the light of emitters, for the light tree.
#pragma once

#include "core/math/api.h"
#include "core/math/math.h"

#include <span>

namespace STROBE_API strobe {

/// The position and the orientation of an emitter at one time.
struct EmitterPose {
    V3f center{0}; ///< of a sphere that contains the emitter, world space
    float radius = 0;
    V3f axis{0, 0, 1};  ///< unit
    float spread = kPi; ///< the largest angle between the axis and a surface normal; π: all directions
};

/// Bounds of an emitter during an interval of shutter fractions, in world space. An emitter is a light at a
/// finite distance, or a triangle of an emissive mesh. The cone is that of Conty Estevez and Kulla
/// ("Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018, section 4.1).
struct EmitterBounds {
    V3f begin{0}, end{0};     ///< center of a sphere at the ends of the interval; linear in between
    float radius = 0;         ///< of the sphere, which contains the emitter at all times
    V3f axis{0, 0, 1};        ///< of the cone of normals; unit
    float spread = kPi;       ///< half-angle θo of the cone of normals
    float emission = kPi / 2; ///< the emission ends at this angle θe from a normal
    bool isTwoSided = false;  ///< emits around the opposite normals, too
    float intensity = 0;      ///< rootMeanSquare of the largest radiant intensity, W/sr
};

/// Sets the positions and the cone of normals of `bounds` from poses at equidistant times, the first and the
/// last of which are the ends of the interval. Pads them for the motion between the poses, which is assumed
/// to be smooth at their distance. Precondition: `poses` is not empty.
void boundPoses(std::span<const EmitterPose> poses, EmitterBounds& bounds);

/// Returns the number of poses to bound a motion with `keys` keys: one if it is static.
inline int poseCount(int keys) { return keys <= 1 ? 1 : std::min(8 * (keys - 1), 128) + 1; }

/// Returns the angle between unit vectors, in radians.
inline float angleBetween(const V3f& a, const V3f& b) { return 2 * std::atan2(length(a - b), length(a + b)); }

} // namespace strobe
