// The interface of cameras.
#pragma once

#include "core/math/api.h"
#include "core/math/soa.h"
#include "core/math/transform.h"

#include <optional>

namespace STROBE_API strobe {

/// A ray. Points on it are o + t d, for t > tmin.
struct Ray {
    V3f o, d;       ///< d has unit length
    float time = 0; ///< shutter fraction in [0,1]: 0 when the shutter opens, 1 when it closes
    float tmin = 0; ///< excludes intersections with the surface that the ray starts on
};

/// A cone around a ray that approximates its footprint isotropically: at distance t, it is width + t * spread
/// wide. The cones of camera rays are one pixel wide, whatever the number of samples per pixel.
struct RayCone {
    float width = 0;  ///< in scene units
    float spread = 0; ///< in radians
};

/// The sample values for one camera ray.
struct CameraSample {
    V2f film;   ///< film position in pixels of the full frame; (0,0) is the top left corner
    V2f lens;   ///< random numbers in [0,1)², for the position on the lens
    float time; ///< shutter fraction in [0,1)
};

/// Camera samples as a structure of arrays.
struct CameraSampleSoA {
    V2SoA film, lens;
    alignas(64) float time[kSoAWidth];
    CameraSample at(int i) const { return {film.at(i), lens.at(i), time[i]}; }
};
/// The origins and unit directions of camera rays, as a structure of arrays.
struct CameraRaySoA {
    V3SoA o, d;
};

/// The projection of a world point onto the film.
struct FilmPoint {
    V2f film;    ///< as CameraSample::film; may lie outside the frame
    float depth; ///< distance along the camera's axis in scene units; for cameras without an axis, distance
};

/// The matrices of a camera at mid-shutter, for row vectors, as OpenEXR defines them: camera space is
/// left-handed with x to the right, y up and z forward; the frame is [0,1]² with y down.
struct CameraMatrices {
    M44f worldToCamera, worldToNdc;
};

/// Interface of cameras. Cameras are immutable, and all functions are thread-safe. Points and directions are
/// in world space; times are shutter fractions. The arrays of SoA functions have n <= kSoAWidth elements. The
/// default SoA functions call the scalar functions; overrides must return the same bits.
class Camera {
  public:
    virtual ~Camera() = default;

    /// Generates rays for samples 0 … n-1.
    virtual void rays(const CameraSample* samples, int n, Ray* out) const = 0;
    /// Generates rays for samples 0 … n-1; same results as `rays`, to the bit.
    virtual void raySoA(const CameraSampleSoA& samples, int n, CameraRaySoA& out) const;

    /// Returns the ray cone of the pixel around a film position.
    virtual RayCone cone(const V2f& film) const = 0;
    /// Returns the ray cones for film positions 0 … n-1; same results as `cone`, to the bit.
    virtual void coneSoA(const V2SoA& film, int n, float* width, float* spread) const;

    /// Returns whether rays depend on CameraSample::lens.
    virtual bool hasLens() const = 0;
    /// Returns whether the camera moves while the shutter is open.
    virtual bool moves() const = 0;

    /// Returns a point at or near the origins of all rays at shutter fraction `time`. A pixel at the world
    /// point p is about cone.width + |p - position| * cone.spread wide.
    virtual V3f position(float time) const = 0;
    /// Returns the origin of the ray through the lens position `lens` (in [0,1)²) and the world point p.
    virtual V3f viewpoint(const V3f& p, const V2f& lens, float time) const = 0;
    /// Returns the viewpoints of points 0 … n-1; same results as `viewpoint`, to the bit.
    virtual void viewpointSoA(const V3SoA& p, const V2SoA& lens, const float* time, int n, V3SoA& out) const;

    /// Projects the world point p through the center of the lens at shutter fraction `time`. Returns nothing
    /// if p is behind the camera.
    virtual std::optional<FilmPoint> project(const V3f& p, float time) const = 0;
    /// Returns the displacement between two film positions. Overridden by cameras whose film wraps around,
    /// which return the shortest displacement.
    virtual V2f filmStep(const V2f& from, const V2f& to) const { return to - from; }
    /// Returns the matrices; none if no matrix describes the projection.
    virtual std::optional<CameraMatrices> matrices() const { return std::nullopt; }
};

/// The arguments of a camera plugin's `create`, in addition to its parameters.
struct CameraArgs {
    KeyedTransform toWorld;
    V2i resolution; ///< of the full frame, in pixels
    Shutter shutter;
};

} // namespace strobe
