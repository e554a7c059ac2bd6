#include "lights/sphere_light.h"

#include "core/math/sampling.h"

namespace strobe {

namespace {

float meanScale(const M44f& m) { return std::cbrt(std::abs(determinant3(m))); }

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

/// A sphere as seen from a point.
struct View {
    V3f to; ///< from the point to the center
    float d2, r2;
    bool inside; ///< or so near that the cone is meaningless
    float oneMinusCosMax;
};

inline View viewOf(const BoundingSphere& s, const V3f& p) {
    View v{s.center - p, 0, sqr(s.radius), false, 2};
    v.d2 = length2(v.to);
    // Within rounding of the surface, inside and outside cannot be told apart: both count as inside.
    v.inside = v.d2 <= v.r2 * (1 + 1e-5f);
    v.oneMinusCosMax = v.inside ? 2 : oneMinusCos(v.r2 / v.d2);
    return v;
}

/// A direction into the cone that the sphere fills, seen from outside.
inline V3f drawInCone(const View& view, const V2f& u, float& distance) {
    const float d = std::sqrt(view.d2);
    const V3f w = uniformCone(u, view.oneMinusCosMax);
    const float sin2 = w.x * w.x + w.y * w.y;
    distance = d * w.z - safeSqrt(view.r2 - view.d2 * sin2);
    return Frame::fromNormal(view.to * (1 / d)).toWorld(w);
}

/// True when some point is inside: then the result is not to be used.
STROBE_TARGET_CLONES bool sampleCones(const BoundingSphere& sphere, const Rgb& radiance,
                                      const LightQuerySoA& q, LightSampleSoA& out) {
    const BoundingSphere s = sphere;
    const float r = radiance.x, g = radiance.y, b = radiance.z;
    int inside = 0;
    STROBE_IVDEP
    for (int i = 0; i < q.n; ++i) {
        const View view = viewOf(s, q.p.at(i));
        inside |= view.inside;
        float distance;
        const V3f wi = drawInCone(view, q.u.at(i), distance);
        out.wi.x[i] = wi.x, out.wi.y[i] = wi.y, out.wi.z[i] = wi.z;
        out.distance[i] = distance;
        out.pdf[i] = uniformConePdf(view.oneMinusCosMax);
        out.radiance.r[i] = r, out.radiance.g[i] = g, out.radiance.b[i] = b;
    }
    return inside;
}

STROBE_TARGET_CLONES void solidAngles(const BoundingSphere& sphere, bool shinesInside, bool shinesOutside,
                                      const V3SoA& p, int n, float* out) {
    const BoundingSphere s = sphere;
    const float within = shinesInside ? 4 * kPi : 0, beyond = shinesOutside ? 2 * kPi : 0;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const View view = viewOf(s, p.at(i));
        out[i] = view.inside ? within : beyond * view.oneMinusCosMax;
    }
}

class SphereLight final : public SurfaceLight {
  public:
    SphereLight(const PlacedShape& shape, const Emission& emission) : SurfaceLight(shape, emission) {
        m_radius = m_shape.shape.quadric->wholeSphereRadius();
        m_stillSphere = sphere(m_stillToWorld);
        m_area = 4 * kPi * sqr(sphereAt(.5f).radius);
    }

    void sample(const V3f& p, float time, const V2f* u, int n, LightSample* out) const override {
        const View view = viewFrom(p, time);
        const Rgb radiance = shinesTo(view) ? m_emission.radiance : Rgb(0);
        if (view.inside)
            return sampleInside(view, radiance, u, n, out);
        for (int i = 0; i < n; ++i) {
            float distance;
            const V3f wi = drawInCone(view, u[i], distance);
            out[i] = {wi, distance, radiance, uniformConePdf(view.oneMinusCosMax)};
        }
    }
    void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const override {
        const Rgb radiance = shines(false) ? m_emission.radiance : Rgb(0);
        if (!m_still || sampleCones(m_stillSphere, radiance, query, out))
            Light::sampleSoA(query, out);
    }

    float pdf(const V3f& p, float time, const V3f& wi, const LightHit*) const override {
        const View view = viewFrom(p, time);
        if (view.inside)
            return kUniformSpherePdf;
        return meets(view, wi) ? uniformConePdf(view.oneMinusCosMax) : 0;
    }

    bool mayIntersect(const V3f& p, float time, const V3f& wi) const override {
        const View view = viewFrom(p, time);
        return shinesTo(view) && (view.inside || meets(view, wi));
    }

    bool cannotSelfOcclude() const override { return true; }

    float solidAngle(const V3f& p, float time) const override {
        const View view = viewFrom(p, time);
        if (!shinesTo(view))
            return 0;
        return view.inside ? 4 * kPi : 2 * kPi * view.oneMinusCosMax;
    }
    void solidAngleSoA(const V3SoA& p, const float* time, int n, float* out) const override {
        if (m_still)
            solidAngles(m_stillSphere, shines(true), shines(false), p, n, out);
        else
            Light::solidAngleSoA(p, time, n, out);
    }

  private:
    BoundingSphere sphere(const M44f& m) const {
        return {transformPoint(m, V3f(0)), m_radius * meanScale(m)};
    }
    BoundingSphere sphereAt(float time) const { return m_still ? m_stillSphere : sphere(toWorld(time)); }

    View viewFrom(const V3f& p, float time) const { return viewOf(sphereAt(time), p); }

    bool shines(bool inside) const { return m_emission.twoSided || inside == m_shape.reverseOrientation; }
    bool shinesTo(const View& view) const { return shines(view.inside); }

    /// With a margin, so that nothing the tracer hits is missed.
    static bool meets(const View& view, const V3f& wi) {
        return dot(view.to, wi) > 0 &&
               length2(cross(view.to, wi)) <= view.r2 * (1 + 1e-4f) + 1e-12f * view.d2;
    }

    /// From inside, or from the surface itself (a furnace wall): directions that leave there meet nothing.
    void sampleInside(const View& view, const Rgb& radiance, const V2f* u, int n, LightSample* out) const {
        const float nothing = 1e-3f * std::sqrt(view.r2);
        for (int i = 0; i < n; ++i) {
            const V3f wi = uniformSphere(u[i]);
            const float b = dot(view.to, wi);
            const float distance = b + safeSqrt(view.r2 - length2(view.to - wi * b));
            out[i] = {wi, distance, distance > nothing ? radiance : Rgb(0), kUniformSpherePdf};
        }
    }

    float m_radius; ///< in object space
    BoundingSphere m_stillSphere;
};

} // namespace

bool staysSphere(const PlacedShape& shape) {
    if (!shape.shape.quadric || !(shape.shape.quadric->wholeSphereRadius() > 0))
        return false;
    // At the keys and between them: interpolated matrices of a rotation are not quite rotations.
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
