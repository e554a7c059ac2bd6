// The common base of area lights: emission, transform and bounds.
#pragma once

#include "core/interfaces/geometry.h"
#include "core/interfaces/light.h"
#include "core/math/sampling.h"

namespace strobe {

/// Diffuse emission of a surface, as radiance in W/(m² sr).
struct Emission {
    Rgb radiance;
    bool twoSided = false;
    std::shared_ptr<const Texture> texture{}; ///< scales the radiance, or null; meshes only
    /// Returns the textured radiance at a surface point.
    Rgb at(const TextureQuery& q) const { return texture ? radiance * texture->rgb(q) : radiance; }
    /// Returns the untextured radiance in a direction whose cosine with the surface normal is `cosTheta`.
    Rgb towards(float cosTheta) const { return twoSided || cosTheta > 0 ? radiance : Rgb(0); }
    /// Returns the flux of a surface of this area.
    Rgb power(float area) const { return radiance * (kPi * area * (twoSided ? 2.f : 1.f)); }
};

struct BoundingSphere {
    V3f center{0};
    float radius = 0;
};
/// Returns a sphere that contains the shape in object space at all times.
BoundingSphere objectSphere(const Shape& shape);
/// Returns a sphere that contains `sphere` transformed by `m`, with a margin for rounding.
BoundingSphere transformSphere(const M44f& m, const BoundingSphere& sphere);
/// Returns the solid angle of the sphere seen from `p`; 4π inside.
STROBE_FORCE_INLINE float sphereSolidAngle(const BoundingSphere& sphere, const V3f& p) {
    const float d2 = length2(sphere.center - p), r2 = sqr(sphere.radius);
    const float oneMinusCosMax = oneMinusCos(r2 / d2);
    return d2 > r2 ? 2 * kPi * oneMinusCosMax : 4 * kPi;
}
/// Returns true if a ray from `p` along the unit vector `wi` may intersect the sphere; conservative.
bool mayIntersectSphere(const BoundingSphere& sphere, const V3f& p, const V3f& wi);

/// The base class of lights on a shape. Points, directions and areas are in world space.
class SurfaceLight : public Light {
  public:
    SurfaceLight(PlacedShape shape, const Emission& emission);
    Rgb emitted(const V3f& ng, const V3f& w, const TextureQuery& q) const final {
        const Rgb radiance = m_emission.towards(dot(ng, w));
        return m_emission.texture && !isBlack(radiance) ? m_emission.at(q) : radiance;
    }
    Rgb power(float) const final { return m_emission.power(m_area) * m_meanTexture; }
    bool mayIntersect(const V3f& p, float time, const V3f& wi) const override {
        return mayIntersectSphere(bounds(time), p, wi);
    }
    float solidAngle(const V3f& p, float time) const override { return sphereSolidAngle(bounds(time), p); }
    /// Bounds the whole light by spheres and, where `normalAt` is known, by a cone.
    std::optional<EmitterBounds> emitterBounds(uint32_t emitter, float begin, float end) const override;
    /// Returns the world-space area at mid-shutter; approximate for quadrics under non-uniform scaling, and
    /// for moving or deforming meshes the mean over the shutter.
    float area() const { return m_area; }

  protected:
    /// Returns the object-to-world transform at shutter fraction `time`.
    M44f toWorld(float time) const { return m_isStatic ? m_staticToWorld : m_shape.toWorld(time); }
    /// Returns a world-space sphere that contains the shape at shutter fraction `time`.
    BoundingSphere bounds(float time) const {
        return m_isStatic ? m_staticBounds : transformSphere(m_shape.toWorld(time), m_objectBounds);
    }
    /// Returns the emitting side's normal of a flat light at shutter fraction `time`; need not have unit
    /// length. The default, for other lights, is zero.
    virtual V3f normalAt(float /*time*/) const { return V3f(0); }
    float normalSign() const { return m_shape.reverseOrientation ? -1.f : 1.f; }

    PlacedShape m_shape;
    Emission m_emission;
    bool m_isStatic; ///< the transform is static (the mesh may deform)
    M44f m_staticToWorld;
    BoundingSphere m_objectBounds, m_staticBounds;
    float m_area = 0;
    Rgb m_meanTexture{1}; ///< approximate mean of the emission texture over the surface
};

} // namespace strobe
