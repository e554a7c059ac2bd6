#include "lights/quadric_light.h"

#include "core/math/sampling.h"

namespace strobe {

namespace {

/// An object-to-world transform with its inverse and determinant.
struct ObjectTransform {
    M44f m, inverse;
    float determinant; ///< absolute
    explicit ObjectTransform(const M44f& toWorld)
        : m(toWorld), inverse(toWorld.inverse()), determinant(std::abs(determinant3(toWorld))) {}
};

/// The emission of a quadric at one time.
struct Emitter {
    ObjectTransform transform;
    Rgb radiance;
    bool twoSided;
    float area; ///< in object space
    float normalSign;

    /// Returns the sample for the world-space point `p` given a point and its unit normal in object space.
    STROBE_FORCE_INLINE LightSample sample(const V3f& p, const V3f& objectPoint,
                                           const V3f& objectNormal) const {
        const V3f d = transformPoint(transform.m, objectPoint) - p;
        // Not normalized: its length is a factor of the area scale.
        const V3f normal = transformNormal(transform.inverse, objectNormal);
        const float d2 = length2(d), distance = std::sqrt(d2);
        const V3f wi = d * (1 / distance);
        const float cosine = -dot(normal, wi) * normalSign;
        const float denominator = area * transform.determinant * std::abs(cosine), pdf = d2 / denominator;
        const bool isValid = (d2 > 0) & (denominator > 0) & (pdf < kInfinity);
        const float sideFactor = isValid & (twoSided | (cosine > 0)) ? 1.f : 0.f;
        LightSample s;
        s.wi.x = d2 > 0 ? wi.x : 0;
        s.wi.y = d2 > 0 ? wi.y : 0;
        s.wi.z = d2 > 0 ? wi.z : 1;
        s.distance = distance;
        s.radiance.x = radiance.x * sideFactor;
        s.radiance.y = radiance.y * sideFactor;
        s.radiance.z = radiance.z * sideFactor;
        s.pdf = isValid ? pdf : 0;
        return s;
    }
};

STROBE_TARGET_CLONES void sampleSurface(const Emitter& emitter, const V3SoA& p, const V3SoA& objectPoint,
                                        const V3SoA& objectNormal, int n, LightSampleSoA& out) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        out.set(i, emitter.sample(p.at(i), objectPoint.at(i), objectNormal.at(i)));
    }
}

/// The half-space from which a flat, one-sided light is visible.
struct VisibleSide {
    M44f toObject;
    V3f center, normal; ///< in object space; the normal of the emitting side
    float margin;       ///< distance behind the plane up to which points count as visible
    STROBE_FORCE_INLINE bool contains(const V3f& p) const {
        return dot(transformPoint(toObject, p) - center, normal) >= -margin;
    }
};

/// Writes upper bounds of the solid angle. `visible`: null if the light is visible from both sides.
STROBE_TARGET_CLONES void boundSolidAngles(const BoundingSphere& bounds, const VisibleSide* visible,
                                           const V3SoA& p, int n, float* out) {
    const BoundingSphere sphere = bounds;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        out[i] = sphereSolidAngle(sphere, p.at(i));
    if (!visible)
        return;
    const VisibleSide side = *visible;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        out[i] = side.contains(p.at(i)) ? out[i] : 0;
}

class QuadricLight final : public SurfaceLight {
  public:
    QuadricLight(const PlacedShape& shape, const Emission& emission)
        : SurfaceLight(shape, emission), m_quadric(*m_shape.shape.quadric),
          m_staticTransform(m_staticToWorld) {
        const ObjectTransform transform(toWorld(.5f));
        // The mean area scale over a grid of points: exact for flat shapes and for uniform scaling.
        double scale = 0;
        constexpr int n = 16;
        for (int i = 0; i < n * n; ++i) {
            const QuadricPoint q =
                m_quadric.samplePoint({(float(i % n) + .5f) / n, (float(i / n) + .5f) / n});
            scale += length(transformNormal(transform.inverse, q.n));
        }
        m_area = m_quadric.area() * transform.determinant * float(scale / (n * n));
        const Box3f box = m_quadric.bounds();
        for (int axis = 0; axis < 3; ++axis)
            if (box.max[axis] - box.min[axis] <= 0)
                m_flatAxis = axis;
        if (m_flatAxis >= 0)
            m_flatNormal = m_quadric.samplePoint({.5f, .5f}).n;
    }

    void sample(const V3f& p, float time, const V2f* u, int n, LightSample* out) const override {
        const Emitter emitter = emitterAt(time);
        for (int i = 0; i < n; ++i) {
            const QuadricPoint q = m_quadric.samplePoint(u[i]);
            out[i] = emitter.sample(p, q.p, q.n);
        }
    }
    void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const override {
        if (!m_isStatic)
            return Light::sampleSoA(query, out);
        V3SoA points, normals;
        m_quadric.samplePointSoA(query.u, query.n, points, normals);
        sampleSurface(emitterAt(0), query.p, points, normals, query.n, out);
    }

    float pdf(const V3f&, float time, const V3f& wi, const LightHit* hit) const override {
        const ObjectTransform transform = transformAt(time);
        // The world-space unit normal transformed to object space has length 1/|n M^-T|; the area scale is
        // det |n M^-T|.
        const float areaScale = transform.determinant / length(transformNormal(transform.m, hit->ng));
        const float denominator = m_quadric.area() * areaScale * absDot(hit->ng, wi);
        return denominator > 0 ? sqr(hit->distance) / denominator : 0;
    }

    bool mayIntersect(const V3f& p, float time, const V3f& wi) const override {
        if (!mayIntersectSphere(bounds(time), p, wi))
            return false;
        return m_flatAxis < 0 || mayIntersectFlat(transformAt(time), p, wi);
    }

    float solidAngle(const V3f& p, float time) const override {
        return !isOneSidedFlat() || visibleSide(time).contains(p) ? sphereSolidAngle(bounds(time), p) : 0;
    }
    void solidAngleSoA(const V3SoA& p, const float* time, int n, float* out) const override {
        if (!m_isStatic)
            return Light::solidAngleSoA(p, time, n, out);
        const VisibleSide side = visibleSide(0);
        boundSolidAngles(m_staticBounds, isOneSidedFlat() ? &side : nullptr, p, n, out);
    }

  protected:
    V3f normalAt(float time) const override {
        return m_flatAxis < 0 ? V3f(0)
                              : transformNormal(transformAt(time).inverse, m_flatNormal) * normalSign();
    }

  private:
    static constexpr float kMargin =
        1e-4f; ///< for rounding here and in the tracer, relative to the size of the shape

    ObjectTransform transformAt(float time) const {
        return m_isStatic ? m_staticTransform : ObjectTransform(toWorld(time));
    }

    bool isOneSidedFlat() const { return m_flatAxis >= 0 && !m_emission.twoSided; }
    VisibleSide visibleSide(float time) const {
        return {transformAt(time).inverse, m_objectBounds.center, m_flatNormal * normalSign(),
                kMargin * m_objectBounds.radius};
    }

    Emitter emitterAt(float time) const {
        return {transformAt(time), m_emission.radiance, m_emission.twoSided, m_quadric.area(), normalSign()};
    }

    /// For a flat shape: returns true if the ray approaches an emitting side and crosses the plane inside the
    /// shape; conservative.
    bool mayIntersectFlat(const ObjectTransform& transform, const V3f& p, const V3f& wi) const {
        const V3f center = m_objectBounds.center, o = transformPoint(transform.inverse, p) - center;
        const V3f d = transformVector(transform.inverse, wi);
        const float height = o[m_flatAxis], margin = kMargin * m_objectBounds.radius;
        if (std::abs(height) <= margin)
            return true; // p is in the plane, up to rounding
        if (height * d[m_flatAxis] >= 0)
            return false;
        if (!m_emission.twoSided && height * m_flatNormal[m_flatAxis] * normalSign() < 0)
            return false;
        // Tests a slightly smaller and a slightly larger shape too, for rounding at the outer and inner rims.
        for (const float scale : {1.f, 1 - kMargin, 1 + kMargin}) {
            float t, u, v;
            if (m_quadric.intersect(center + o * scale, d, 0, kInfinity, t, u, v))
                return true;
        }
        return false;
    }

    const Quadric& m_quadric;
    ObjectTransform m_staticTransform;
    int m_flatAxis = -1; ///< the object axis along which the shape has no extent, or -1
    V3f m_flatNormal{0};
};

} // namespace

std::shared_ptr<SurfaceLight> makeQuadricLight(const PlacedShape& shape, const Emission& emission) {
    return std::make_shared<QuadricLight>(shape, emission);
}

} // namespace strobe
