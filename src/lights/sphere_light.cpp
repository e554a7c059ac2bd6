#include "lights/sphere_light.h"

#include "core/math/sampling.h"

namespace strobe {

namespace {

/// Returns the geometric mean of the scales along three orthogonal axes.
float meanScale(const M44f& m) { return std::cbrt(std::abs(determinant3(m))); }

/// Returns true if the transform is a rotation or reflection with uniform scale, up to rounding.
bool isSimilarity(const M44f& m) {
    const float s2 = sqr(meanScale(m)), tolerance = 1e-5f * s2;
    const V3f rows[3] = {
        {m[0][0], m[0][1], m[0][2]}, {m[1][0], m[1][1], m[1][2]}, {m[2][0], m[2][1], m[2][2]}};
    for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j)
            if (!(std::abs(dot(rows[i], rows[j]) - (i == j ? s2 : 0)) <= tolerance))
                return false;
    return s2 > 0;
}

/// The cone that a sphere subtends at a point.
struct SphereView {
    V3f toCenter;  ///< from the point
    float d2, r2;  ///< squared distance of the center, squared radius
    bool isInside; ///< the point is inside the sphere, or too close to it for a cone
    float oneMinusCosMax;
};

inline SphereView viewSphere(const BoundingSphere& s, const V3f& p) {
    SphereView v{s.center - p, 0, sqr(s.radius), false, 2};
    v.d2 = length2(v.toCenter);
    // Points on the surface, up to rounding, count as inside.
    v.isInside = v.d2 <= v.r2 * (1 + 1e-5f);
    v.oneMinusCosMax = v.isInside ? 2 : oneMinusCos(v.r2 / v.d2);
    return v;
}

/// Draws a direction in the cone for a point outside; u in [0,1)². Also writes the distance of the sphere.
inline V3f sampleCone(const SphereView& view, const V2f& u, float& distance) {
    const float d = std::sqrt(view.d2);
    const V3f w = uniformCone(u, view.oneMinusCosMax);
    const float sin2 = w.x * w.x + w.y * w.y;
    distance = d * w.z - safeSqrt(view.r2 - view.d2 * sin2);
    return Frame::fromNormal(view.toCenter * (1 / d)).toWorld(w);
}

/// Samples the cones of all points. Returns true if a point is inside; the output is then not valid.
STROBE_TARGET_CLONES bool sampleCones(const BoundingSphere& sphere, const Rgb& radiance,
                                      const LightQuerySoA& q, LightSampleSoA& out) {
    const BoundingSphere s = sphere;
    const float r = radiance.x, g = radiance.y, b = radiance.z;
    int anyInside = 0;
    STROBE_IVDEP
    for (int i = 0; i < q.n; ++i) {
        const SphereView view = viewSphere(s, q.p.at(i));
        anyInside |= view.isInside;
        float distance;
        const V3f wi = sampleCone(view, q.u.at(i), distance);
        out.wi.x[i] = wi.x;
        out.wi.y[i] = wi.y;
        out.wi.z[i] = wi.z;
        out.distance[i] = distance;
        out.pdf[i] = uniformConePdf(view.oneMinusCosMax);
        out.radiance.r[i] = r;
        out.radiance.g[i] = g;
        out.radiance.b[i] = b;
    }
    return anyInside;
}

STROBE_TARGET_CLONES void solidAngles(const BoundingSphere& sphere, bool emitsInside, bool emitsOutside,
                                      const V3SoA& p, int n, float* out) {
    const BoundingSphere s = sphere;
    const float inside = emitsInside ? 4 * kPi : 0, outside = emitsOutside ? 2 * kPi : 0;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const SphereView view = viewSphere(s, p.at(i));
        out[i] = view.isInside ? inside : outside * view.oneMinusCosMax;
    }
}

class SphereLight final : public SurfaceLight {
  public:
    SphereLight(const PlacedShape& shape, const Emission& emission) : SurfaceLight(shape, emission) {
        m_radius = m_shape.shape.quadric->wholeSphereRadius();
        m_staticSphere = sphere(m_staticToWorld);
        m_area = 4 * kPi * sqr(sphereAt(.5f).radius);
    }

    void sample(const V3f& p, float time, const V2f* u, int n, LightSample* out) const override {
        const SphereView view = viewFrom(p, time);
        const Rgb radiance = emitsTo(view) ? m_emission.radiance : Rgb(0);
        if (view.isInside)
            return sampleInside(view, radiance, u, n, out);
        for (int i = 0; i < n; ++i) {
            float distance;
            const V3f wi = sampleCone(view, u[i], distance);
            out[i] = {wi, distance, radiance, uniformConePdf(view.oneMinusCosMax)};
        }
    }
    void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const override {
        const Rgb radiance = emits(false) ? m_emission.radiance : Rgb(0);
        if (!m_isStatic || sampleCones(m_staticSphere, radiance, query, out))
            Light::sampleSoA(query, out);
    }

    float pdf(const V3f& p, float time, const V3f& wi, const LightHit*) const override {
        const SphereView view = viewFrom(p, time);
        if (view.isInside)
            return kUniformSpherePdf;
        return mayIntersect(view, wi) ? uniformConePdf(view.oneMinusCosMax) : 0;
    }

    bool mayIntersect(const V3f& p, float time, const V3f& wi) const override {
        const SphereView view = viewFrom(p, time);
        return emitsTo(view) && (view.isInside || mayIntersect(view, wi));
    }

    bool cannotSelfOcclude() const override { return true; }

    float solidAngle(const V3f& p, float time) const override {
        const SphereView view = viewFrom(p, time);
        if (!emitsTo(view))
            return 0;
        return view.isInside ? 4 * kPi : 2 * kPi * view.oneMinusCosMax;
    }
    void solidAngleSoA(const V3SoA& p, const float* time, int n, float* out) const override {
        if (m_isStatic)
            solidAngles(m_staticSphere, emits(true), emits(false), p, n, out);
        else
            Light::solidAngleSoA(p, time, n, out);
    }

  private:
    BoundingSphere sphere(const M44f& m) const {
        return {transformPoint(m, V3f(0)), m_radius * meanScale(m)};
    }
    BoundingSphere sphereAt(float time) const { return m_isStatic ? m_staticSphere : sphere(toWorld(time)); }

    SphereView viewFrom(const V3f& p, float time) const { return viewSphere(sphereAt(time), p); }

    /// Returns true if the inner (or outer) side of the sphere emits.
    bool emits(bool inside) const { return m_emission.twoSided || inside == m_shape.reverseOrientation; }
    bool emitsTo(const SphereView& view) const { return emits(view.isInside); }

    /// Returns true if direction `wi` may intersect the sphere, with a margin for rounding in the tracer.
    static bool mayIntersect(const SphereView& view, const V3f& wi) {
        return dot(view.toCenter, wi) > 0 &&
               length2(cross(view.toCenter, wi)) <= view.r2 * (1 + 1e-4f) + 1e-12f * view.d2;
    }

    /// Draws samples for a point inside or on the surface. On the surface, directions that leave the sphere
    /// hit nothing and get no radiance.
    void sampleInside(const SphereView& view, const Rgb& radiance, const V2f* u, int n,
                      LightSample* out) const {
        const float minDistance = 1e-3f * std::sqrt(view.r2);
        for (int i = 0; i < n; ++i) {
            const V3f wi = uniformSphere(u[i]);
            const float b = dot(view.toCenter, wi);
            const float distance = b + safeSqrt(view.r2 - length2(view.toCenter - wi * b));
            out[i] = {wi, distance, distance > minDistance ? radiance : Rgb(0), kUniformSpherePdf};
        }
    }

    float m_radius; ///< in object space
    BoundingSphere m_staticSphere;
};

} // namespace

bool isSphereAtAllTimes(const PlacedShape& shape) {
    if (!shape.shape.quadric || !(shape.shape.quadric->wholeSphereRadius() > 0))
        return false;
    // Tests times between keys too: interpolated matrices of rotations are not exact rotations.
    const int steps = shape.motion && !shape.motion->isStatic() ? 4 * (shape.motion->keyCount() - 1) : 0;
    for (int i = 0; i <= steps; ++i)
        if (!isSimilarity(shape.toWorld(steps > 0 ? float(i) / float(steps) : 0)))
            return false;
    return true;
}

std::shared_ptr<SurfaceLight> makeSphereLight(const PlacedShape& shape, const Emission& emission) {
    return std::make_shared<SphereLight>(shape, emission);
}

} // namespace strobe
