// The camera seam.
#pragma once

#include "core/math/soa.h"
#include "core/math/transform.h"

#include <optional>

namespace strobe {

/// A ray. `time` is a fraction of the shutter interval, in [0, 1]: everything downstream of the camera counts
/// time so.
struct Ray {
    V3f o, d; ///< d has unit length
    float time = 0;
    float tmin = 0; ///< hits nearer than this are the surface that the ray left
};

/// The isotropic cone a ray stands for: its width at a distance t along the ray is width + t * spread (scene
/// units; spread in radians). At the camera it is one whole pixel wide, whatever the number of samples.
struct RayCone {
    float width = 0;
    float spread = 0;
};

struct CameraSample {
    V2f film;   ///< in pixels of the full frame, (0,0) the top left corner of the top left pixel
    V2f lens;   ///< in [0,1)²
    float time; ///< shutter fraction in [0,1)
};

/// CameraSamples side by side.
struct CameraSampleSoA {
    V2SoA film, lens;
    alignas(64) float time[kSoAWidth];
    CameraSample at(int i) const { return {film.at(i), lens.at(i), time[i]}; }
};
/// Where their rays start, and the unit vectors along which they go.
struct CameraRaySoA {
    V3SoA o, d;
};

/// Where on the film a world point is seen.
struct FilmPoint {
    V2f film;    ///< as CameraSample::film
    float depth; ///< along the camera's axis, in scene units; its distance, from a camera that has none
};

class Camera {
  public:
    virtual ~Camera() = default;
    /// out[i] = the ray of samples[i], in world space.
    virtual void rays(const CameraSample* samples, int n, Ray* out) const = 0;
    /// The same rays of samples 0 … n-1, side by side.
    virtual void raySoA(const CameraSampleSoA& samples, int n, CameraRaySoA& out) const;
    /// The cone of one pixel around a film point.
    virtual RayCone cone(const V2f& film) const = 0;
    /// Their widths and spreads around film points 0 … n-1.
    virtual void coneSoA(const V2SoA& film, int n, float* width, float* spread) const;
    /// True when rays need `CameraSample::lens`.
    virtual bool hasLens() const = 0;
    /// True when the camera moves during the shutter.
    virtual bool moves() const = 0;
    /// Some point in or near all rays' origins, at shutter fraction `time`, in world space; the size of one
    /// pixel at a world point p is about cone.width + |p - position| * cone.spread.
    virtual V3f position(float time) const = 0;
    /// Where a ray starts that goes through the lens at `lens` (in [0,1)²) and meets the world point p.
    virtual V3f viewpoint(const V3f& p, const V2f& lens, float time) const = 0;
    /// The same for world points 0 … n-1.
    virtual void viewpointSoA(const V3SoA& p, const V2SoA& lens, const float* time, int n, V3SoA& out) const;
    /// Where the world point p is seen through the middle of the lens at shutter fraction `time`, on the film
    /// or beside it; nothing if it is behind the camera.
    virtual std::optional<FilmPoint> project(const V3f& p, float time) const = 0;
    /// The way on the film from one point to another: the shorter one where the film closes on itself.
    virtual V2f filmStep(const V2f& from, const V2f& to) const { return to - from; }
};

/// What a camera plugin's `create` gets besides its parameters.
struct CameraArgs {
    KeyedTransform toWorld;
    V2i resolution;
    Shutter shutter;
};

} // namespace strobe
