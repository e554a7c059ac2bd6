// The interface of lights.
#pragma once

#include "core/interfaces/emitter_bounds.h"
#include "core/interfaces/geometry.h"
#include "core/math/api.h"
#include "core/math/soa.h"

#include <optional>

namespace STROBE_API strobe {

/// A sampled direction from a point to a light.
struct LightSample {
    V3f wi;         ///< unit vector from the point towards the light
    float distance; ///< to the light along wi; infinity for lights at infinity
    /// Radiance that arrives along wi if nothing occludes the light. For delta lights, the weight of the
    /// delta distribution (e.g. intensity / distance²). Zero: the sample has no contribution.
    Rgb radiance;
    float pdf; ///< per solid angle at the point; 1 for delta lights; positive unless `radiance` is zero
};

/// The intersection of a ray with a light's surface, for Light::pdf.
struct LightHit {
    V3f p, ng;      ///< world space; ng is the geometric normal as in Light::emitted
    float distance; ///< from the shaded point
    uint32_t prim;  ///< triangle of a mesh light
};

/// The arguments of Light::sampleSoA, one element per sample.
struct LightQuerySoA {
    const V3SoA& p;       ///< shaded points, world space
    const float* time;    ///< shutter fractions
    const int32_t* point; ///< identifies the shaded point: equal neighbors have equal p and time
    const V2SoA& u;       ///< random numbers in [0,1)²; undefined for delta lights
    int n;                ///< number of samples, at most kSoAWidth
};
/// Light samples as a structure of arrays.
struct LightSampleSoA {
    V3SoA wi;
    RgbSoA radiance;
    alignas(64) float distance[kSoAWidth], pdf[kSoAWidth];

    void set(int i, const LightSample& s) {
        wi.set(i, s.wi);
        radiance.set(i, s.radiance);
        distance[i] = s.distance;
        pdf[i] = s.pdf;
    }
};

/// The maximum value of Light::sampleCount. With more samples, a batch would take minutes to shade.
inline constexpr int kMaxLightSamples = 1 << 16;

/// Interface of lights. Lights are immutable after construction, and all functions are thread-safe. Points
/// and directions are in world space, directions have unit length, and times are shutter fractions in [0,1].
/// Densities are per solid angle, seen from the shaded point p. The default SoA functions call the scalar
/// functions; overrides must return the same bits.
class Light {
  public:
    virtual ~Light() = default;

    /// Samples n directions from p to the light, with random numbers u[i] in [0,1)². Delta lights ignore u.
    virtual void sample(const V3f& p, float time, const V2f* u, int n, LightSample* out) const = 0;
    /// Samples directions from several points; same results as `sample`, to the bit.
    virtual void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const;
    /// Returns the density with which `sample` generates the direction wi. `hit` is the intersection of the
    /// ray from p along wi with the light's surface; null for environment lights. Not called for delta
    /// lights.
    virtual float pdf(const V3f& p, float time, const V3f& wi, const LightHit* hit) const = 0;

    /// Returns false only if the ray from p along wi cannot intersect the light, or the light emits nothing
    /// towards p; then the ray need not be traced to evaluate this light. A conservative test.
    virtual bool mayIntersect(const V3f& p, float time, const V3f& wi) const = 0;
    /// Returns an upper bound of the solid angle that the light subtends at p, at most 4π; 0 for delta
    /// lights.
    virtual float solidAngle(const V3f& p, float time) const = 0;
    /// Bounds the solid angles for points 0 … n-1, n <= kSoAWidth; same results as `solidAngle`, to the bit.
    virtual void solidAngleSoA(const V3SoA& p, const float* time, int n, float* out) const;

    /// Returns the radiance that the surface of an area light emits in direction w (away from the surface),
    /// at a point with geometric normal ng, which points to the side given by vertex normals and
    /// reverseOrientation and is not flipped towards the viewer. The default, for other lights, is black.
    virtual Rgb emitted(const V3f& /*ng*/, const V3f& /*w*/, const TextureQuery& /*q*/) const {
        return Rgb(0);
    }
    /// Returns the emitted radiance of a light without a texture.
    Rgb emitted(const V3f& ng, const V3f& w) const { return emitted(ng, w, {}); }
    /// Returns the radiance that arrives from infinity along a ray in direction d (away from the scene). The
    /// default, for other lights, is black.
    virtual Rgb environment(const V3f& /*d*/) const { return Rgb(0); }
    /// Returns the radiance of environment lights for directions 0 … n-1, n <= kSoAWidth, and the density of
    /// `sample` for these directions, unless `pdf` is null; same results as `environment` and `pdf`, to the
    /// bit.
    virtual void environmentSoA(const V3SoA& d, int n, RgbSoA& radiance, float* pdf) const;

    /// Returns an estimate of the emitted flux, for the choice of a light among many. `radius` is the radius
    /// of the scene's bounding sphere.
    virtual Rgb power(float radius) const = 0;
    // The emitters of the light, which are the leaves of the light tree: the light as a whole, or each
    // triangle of a mesh.

    /// Returns the number of emitters. If it is not 1, emitter i is triangle i of the light's mesh.
    virtual uint32_t emitterCount() const { return 1; }
    /// Returns bounds of an emitter for the shutter fractions `begin` to `end`. The default returns none:
    /// the light is at infinity, or its position is unknown.
    virtual std::optional<EmitterBounds> emitterBounds(uint32_t /*emitter*/, float /*begin*/,
                                                       float /*end*/) const {
        return std::nullopt;
    }
    /// Samples a direction from p to the emitter, with u in [0,1)²; delta lights ignore u. The density is
    /// that of the directions to this emitter alone.
    virtual LightSample sampleEmitter(uint32_t emitter, const V3f& p, float time, const V2f& u) const;
    /// Returns the density with which `sampleEmitter` generates the direction wi. Arguments as of `pdf`.
    virtual float emitterPdf(uint32_t /*emitter*/, const V3f& p, float time, const V3f& wi,
                             const LightHit* hit) const {
        return pdf(p, time, wi, hit);
    }

    /// Returns whether the light has a delta distribution: rays cannot hit it by chance.
    virtual bool isDelta() const { return false; }
    /// Returns whether the light is at infinity and visible to rays that miss the scene.
    virtual bool isEnvironment() const { return false; }
    /// Returns whether the light's own shape never occludes the directions of `sample`; then shadow rays
    /// ignore it.
    virtual bool cannotSelfOcclude() const { return false; }

    int sampleCount = 1; ///< samples per shaded point, set by the scene
    int group = 0;       ///< index of the light group, set by the scene
};

/// The arguments of a light plugin's `create`, in addition to its parameters.
struct LightArgs {
    KeyedTransform toWorld;
    Shutter shutter;
};
/// The arguments of an area light plugin's `create`. It is called once for each placed shape.
struct AreaLightArgs {
    PlacedShape shape;
};

} // namespace strobe
