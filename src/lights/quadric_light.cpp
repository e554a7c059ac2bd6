#include "lights/quadric_light.h"

#include "core/math/sampling.h"

namespace strobe {

namespace {

/// A transform with what normals and areas need.
struct Placed {
    M44f m, inverse;
    float determinant; ///< absolute
    explicit Placed(const M44f& toWorld)
        : m(toWorld), inverse(toWorld.inverse()), determinant(std::abs(determinant3(toWorld))) {}
};

/// How a point of a surface shines, seen from elsewhere.
struct Shine {
    Placed placed;
    Rgb radiance;
    bool twoSided;
    float area, normalSign; ///< area: in object space

    STROBE_FORCE_INLINE LightSample seen(const V3f& from, const V3f& onShape,
                                         const V3f& normalOfShape) const {
        const V3f d = transformPoint(placed.m, onShape) - from;
        // Its length is part of the stretch.
        const V3f normal = transformNormal(placed.inverse, normalOfShape);
        const float d2 = length2(d), distance = std::sqrt(d2);
        const V3f wi = d * (1 / distance);
        const float cosine = -dot(normal, wi) * normalSign;
        const float denominator = area * placed.determinant * std::abs(cosine), pdf = d2 / denominator;
        const bool exists = (d2 > 0) & (denominator > 0) & (pdf < kInfinity);
        const float lit = exists & (twoSided | (cosine > 0)) ? 1.f : 0.f;
        LightSample s;
        s.wi.x = d2 > 0 ? wi.x : 0, s.wi.y = d2 > 0 ? wi.y : 0, s.wi.z = d2 > 0 ? wi.z : 1;
        s.distance = distance;
        s.radiance.x = radiance.x * lit, s.radiance.y = radiance.y * lit, s.radiance.z = radiance.z * lit;
        s.pdf = exists ? pdf : 0;
        return s;
    }
};

STROBE_TARGET_CLONES void seenFrom(const Shine& shine, const V3SoA& from, const V3SoA& onShape,
                                   const V3SoA& normal, int n, LightSampleSoA& out) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const LightSample s = shine.seen(from.at(i), onShape.at(i), normal.at(i));
        out.wi.x[i] = s.wi.x, out.wi.y[i] = s.wi.y, out.wi.z[i] = s.wi.z;
        out.radiance.r[i] = s.radiance.x, out.radiance.g[i] = s.radiance.y, out.radiance.b[i] = s.radiance.z;
        out.distance[i] = s.distance, out.pdf[i] = s.pdf;
    }
}

/// Where a flat shape that shines on one side is to be seen from.
struct Front {
    M44f toObject;
    V3f center, normal; ///< of the side that shines
    float behind;       ///< how far behind, along the normal, nothing is seen
    STROBE_FORCE_INLINE bool isSeenFrom(const V3f& p) const {
        return dot(transformPoint(toObject, p) - center, normal) >= -behind;
    }
};

/// `front`: null where the whole shape shines.
STROBE_TARGET_CLONES void solidAngles(const BoundingSphere& bounds, const Front* front, const V3SoA& p, int n,
                                      float* out) {
    const BoundingSphere sphere = bounds;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        out[i] = sphereSolidAngle(sphere, p.at(i));
    if (!front)
        return;
    const Front side = *front;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        out[i] = side.isSeenFrom(p.at(i)) ? out[i] : 0;
}

class QuadricLight final : public SurfaceLight {
  public:
    QuadricLight(const PlacedShape& shape, const Emission& emission)
        : SurfaceLight(shape, emission), m_quadric(*m_shape.shape.quadric), m_stillPlaced(m_stillToWorld) {
        const Placed placed(toWorld(.5f));
        double stretch = 0; // the mean over a grid of points: exact for flat shapes and even scales
        constexpr int n = 16;
        for (int i = 0; i < n * n; ++i) {
            const QuadricPoint q =
                m_quadric.samplePoint({(float(i % n) + .5f) / n, (float(i / n) + .5f) / n});
            stretch += length(transformNormal(placed.inverse, q.n));
        }
        m_area = m_quadric.area() * placed.determinant * float(stretch / (n * n));
        const Box3f box = m_quadric.bounds();
        for (int axis = 0; axis < 3; ++axis)
            if (box.max[axis] - box.min[axis] <= 0)
                m_flatAxis = axis;
        if (m_flatAxis >= 0)
            m_flatNormal = m_quadric.samplePoint({.5f, .5f}).n;
    }

    void sample(const V3f& p, float time, const V2f* u, int n, LightSample* out) const override {
        const Shine shine = shineAt(time);
        for (int i = 0; i < n; ++i) {
            const QuadricPoint q = m_quadric.samplePoint(u[i]);
            out[i] = shine.seen(p, q.p, q.n);
        }
    }
    void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const override {
        if (!m_still)
            return Light::sampleSoA(query, out);
        V3SoA points, normals;
        m_quadric.samplePointSoA(query.u, query.n, points, normals);
        seenFrom(shineAt(0), query.p, points, normals, query.n, out);
    }

    float pdf(const V3f&, float time, const V3f& wi, const LightHit* hit) const override {
        const Placed placed = placedAt(time);
        // The world's unit normal back in object space has length 1/|n M^-T|: areas stretch by det |n M^-T|.
        const float stretch = placed.determinant / length(transformNormal(placed.m, hit->ng));
        const float denominator = m_quadric.area() * stretch * absDot(hit->ng, wi);
        return denominator > 0 ? sqr(hit->distance) / denominator : 0;
    }

    bool mayIntersect(const V3f& p, float time, const V3f& wi) const override {
        if (!meetsSphere(bounds(time), p, wi))
            return false;
        return m_flatAxis < 0 || mayIntersectFlat(placedAt(time), p, wi);
    }

    float solidAngle(const V3f& p, float time) const override {
        return !hasFront() || frontAt(time).isSeenFrom(p) ? sphereSolidAngle(bounds(time), p) : 0;
    }
    void solidAngleSoA(const V3SoA& p, const float* time, int n, float* out) const override {
        if (!m_still)
            return Light::solidAngleSoA(p, time, n, out);
        const Front front = frontAt(0);
        solidAngles(m_stillBounds, hasFront() ? &front : nullptr, p, n, out);
    }

  private:
    static constexpr float kMargin = 1e-4f; ///< of the shape's size: against rounding, here or in the tracer

    Placed placedAt(float time) const { return m_still ? m_stillPlaced : Placed(toWorld(time)); }

    bool hasFront() const { return m_flatAxis >= 0 && !m_emission.twoSided; }
    Front frontAt(float time) const {
        return {placedAt(time).inverse, m_objectBounds.center, m_flatNormal * normalSign(),
                kMargin * m_objectBounds.radius};
    }

    Shine shineAt(float time) const {
        return {placedAt(time), m_emission.radiance, m_emission.twoSided, m_quadric.area(), normalSign()};
    }

    /// For a shape in a plane: whether the ray leaves towards a shining side and crosses the plane in the
    /// shape.
    bool mayIntersectFlat(const Placed& placed, const V3f& p, const V3f& wi) const {
        const V3f center = m_objectBounds.center, o = transformPoint(placed.inverse, p) - center;
        const V3f d = transformVector(placed.inverse, wi);
        const float height = o[m_flatAxis], margin = kMargin * m_objectBounds.radius;
        if (std::abs(height) <= margin)
            return true; // in the plane: cannot be told
        if (height * d[m_flatAxis] >= 0)
            return false;
        if (!m_emission.twoSided && height * m_flatNormal[m_flatAxis] * normalSign() < 0)
            return false;
        // The shape a little larger and a little smaller, for its outer and inner rims.
        for (const float scale : {1.f, 1 - kMargin, 1 + kMargin}) {
            float t, u, v;
            if (m_quadric.intersect(center + o * scale, d, 0, kInfinity, t, u, v))
                return true;
        }
        return false;
    }

    const Quadric& m_quadric;
    Placed m_stillPlaced;
    int m_flatAxis = -1; ///< the object axis along which the shape has no extent, or -1
    V3f m_flatNormal{0};
};

} // namespace

std::shared_ptr<SurfaceLight> makeQuadricLight(const PlacedShape& shape, const Emission& emission) {
    return std::make_shared<QuadricLight>(shape, emission);
}

} // namespace strobe
