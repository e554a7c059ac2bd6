// What the lights with a surface share: how it shines, and where it lies.
#pragma once

#include "core/interfaces/geometry.h"
#include "core/interfaces/light.h"
#include "core/math/sampling.h"

namespace strobe {

/// Diffuse emission of a surface.
struct Emission {
    Rgb radiance;
    bool twoSided = false;
    std::shared_ptr<const Texture> texture{}; ///< multiplies it, or null; meshes only
    Rgb at(const TextureQuery& q) const { return texture ? radiance * texture->rgb(q) : radiance; }
    /// Towards a direction whose cosine with the surface's normal is `cosTheta`.
    Rgb towards(float cosTheta) const { return twoSided || cosTheta > 0 ? radiance : Rgb(0); }
    /// The flux of a surface of area `area`.
    Rgb power(float area) const { return radiance * (kPi * area * (twoSided ? 2.f : 1.f)); }
};

struct BoundingSphere {
    V3f center{0};
    float radius = 0;
};
/// A sphere around a shape in its object space, whatever the time.
BoundingSphere objectSphere(const Shape& shape);
/// A sphere that holds `sphere` after the transform `m`, enlarged a little against rounding.
BoundingSphere transformSphere(const M44f& m, const BoundingSphere& sphere);
/// The solid angle of a sphere seen from p: 4π within.
STROBE_FORCE_INLINE float sphereSolidAngle(const BoundingSphere& sphere, const V3f& p) {
    const float d2 = length2(sphere.center - p), r2 = sqr(sphere.radius), part = oneMinusCos(r2 / d2);
    return d2 > r2 ? 2 * kPi * part : 4 * kPi;
}
/// True when a ray from p along unit wi meets the sphere.
bool meetsSphere(const BoundingSphere& sphere, const V3f& p, const V3f& wi);

/// The base of lights with a surface: emission, transform and bounds. All areas and points are the world's.
class SurfaceLight : public Light {
  public:
    SurfaceLight(PlacedShape shape, const Emission& emission);
    Rgb emitted(const V3f& ng, const V3f& w, const TextureQuery& at) const final {
        const Rgb radiance = m_emission.towards(dot(ng, w));
        return m_emission.texture && !isBlack(radiance) ? m_emission.at(at) : radiance;
    }
    Rgb power(float) const final { return m_emission.power(m_area) * m_meanFactor; }
    bool mayIntersect(const V3f& p, float time, const V3f& wi) const override {
        return meetsSphere(bounds(time), p, wi);
    }
    float solidAngle(const V3f& p, float time) const override { return sphereSolidAngle(bounds(time), p); }
    /// World area at mid-shutter, approximate for unevenly scaled quadrics.
    float area() const { return m_area; }

  protected:
    /// Object to world at shutter fraction `time`.
    M44f toWorld(float time) const { return m_still ? m_stillToWorld : m_shape.toWorld(time); }
    BoundingSphere bounds(float time) const {
        return m_still ? m_stillBounds : transformSphere(m_shape.toWorld(time), m_objectBounds);
    }
    float normalSign() const { return m_shape.reverseOrientation ? -1.f : 1.f; }

    PlacedShape m_shape;
    Emission m_emission;
    bool m_still; ///< the transform does not move (the mesh may deform)
    M44f m_stillToWorld;
    BoundingSphere m_objectBounds, m_stillBounds;
    float m_area = 0;
    Rgb m_meanFactor{1}; ///< of the emission's texture over the surface, about
};

} // namespace strobe
