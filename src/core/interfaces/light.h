// The light seam.
#pragma once

#include "core/interfaces/geometry.h"
#include "core/math/soa.h"

namespace strobe {

/// One direction in which a light is seen from a point.
struct LightSample {
    V3f wi;         ///< unit vector from the point to the light
    float distance; ///< to the light along wi; infinity for lights at infinity
    Rgb radiance; ///< arriving along wi if nothing is in between. Delta lights: intensity / distance² and the
                  ///< like, with pdf = 1. Zero: no contribution
    float pdf; ///< per solid angle, seen from the point; > 0 where radiance is not zero
};

/// The point where a ray met a light's surface, for `Light::pdf`.
struct LightHit {
    V3f p, ng;      ///< world space; ng is the surface's own normal, not turned
    float distance; ///< from the shaded point
    uint32_t prim;  ///< triangle of a mesh light
};

/// Where a light is to be sampled from, side by side; all by sample.
struct LightQuerySoA {
    const V3SoA& p;
    const float* time;    ///< shutter fraction
    const int32_t* point; ///< a number: neighbors with the same number are at the same point and time
    const V2SoA& u;       ///< in [0,1)²; of delta lights nothing: they need none
    int n;
};
/// LightSamples side by side.
struct LightSampleSoA {
    V3SoA wi;
    RgbSoA radiance;
    alignas(64) float distance[kSoAWidth], pdf[kSoAWidth];

    void set(int i, const LightSample& s) {
        wi.set(i, s.wi), radiance.set(i, s.radiance);
        distance[i] = s.distance, pdf[i] = s.pdf;
    }
};

/// More samples of a light at one surface are a mistake: shading a batch would take minutes.
inline constexpr int kMaxLightSamples = 1 << 16;

class Light {
  public:
    virtual ~Light() = default;
    /// out[i] = a sample seen from `p` at shutter fraction `time`, drawn with u[i] in [0,1)².
    virtual void sample(const V3f& p, float time, const V2f* u, int n, LightSample* out) const = 0;
    /// The same samples of several points at once.
    virtual void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const;
    /// The density per solid angle of `sample` for direction wi from p. `hit` is where the ray met the
    /// light's surface (area lights), or null for environment lights. Never called on delta lights.
    virtual float pdf(const V3f& p, float time, const V3f& wi, const LightHit* hit) const = 0;
    /// False when a ray from p along wi certainly misses the light: such a ray is not traced for its sake.
    virtual bool mayIntersect(const V3f& p, float time, const V3f& wi) const = 0;
    /// An upper bound of the solid angle the light fills, seen from p (at most 4π); 0 for delta lights.
    virtual float solidAngle(const V3f& p, float time) const = 0;
    /// The same of points 0 … n-1.
    virtual void solidAngleSoA(const V3SoA& p, const float* time, int n, float* out) const;
    /// Radiance leaving the light's surface towards `w` (unit) at a point with surface normal ng. Area
    /// lights.
    virtual Rgb emitted(const V3f& /*ng*/, const V3f& /*w*/, const TextureQuery& /*at*/) const {
        return Rgb(0);
    }
    /// Of a light without a texture.
    Rgb emitted(const V3f& ng, const V3f& w) const { return emitted(ng, w, {}); }
    /// Radiance arriving from infinity along the reversed direction `d` (unit, away from the scene).
    /// Environments.
    virtual Rgb environment(const V3f& /*d*/) const { return Rgb(0); }
    /// The same of directions 0 … n-1, with the density of `sample` there; `pdf` may be null: not wanted.
    virtual void environmentSoA(const V3SoA& d, int n, RgbSoA& radiance, float* pdf) const;
    /// A rough figure of the total flux, to choose one light among many. `radius`: of the scene's bounding
    /// sphere.
    virtual Rgb power(float radius) const = 0;
    virtual bool isDelta() const { return false; }
    virtual bool isEnvironment() const { return false; }
    /// True when the light's own shape never lies before its samples: rays to them need not ask it.
    virtual bool cannotSelfOcclude() const { return false; }
    /// Samples per shading point that the scene asks for.
    int sampleCount = 1;
    /// A number for the group that the scene puts it in, from 0.
    int group = 0;
};

/// What a light plugin's `create` gets besides its parameters.
struct LightArgs {
    KeyedTransform toWorld;
    Shutter shutter;
};
/// What an area light plugin's `create` gets: the shape that shines. One light is made per placed shape.
struct AreaLightArgs {
    PlacedShape shape;
};

} // namespace strobe
