#include "lights/mesh_light.h"

#include "core/math/sampling.h"

namespace strobe {

namespace {

/// A triangle in the world.
struct WorldTriangle {
    V3f p0, e1, e2;
    V3f cross; ///< of the edges: twice the area long; along the surface normal up to sign
};

/// A lit plane: a mesh that is flat and still, whose triangles all face the same way.
struct Plane {
    V3f n{0}; ///< the surface's normal
    bool valid = false;
};

class MeshLight final : public SurfaceLight {
  public:
    MeshLight(const PlacedShape& shape, const Emission& emission)
        : SurfaceLight(shape, emission), m_mesh(*m_shape.shape.mesh),
          m_areasStay(m_still && !m_mesh.deforms()) {
        std::vector<float> areas(m_mesh.triangleCount());
        for (uint32_t i = 0; i < areas.size(); ++i)
            areas[i] = meanArea(i);
        double sum = 0;
        for (const float a : areas)
            sum += a;
        m_area = float(sum);
        if (m_area > 0 && std::isfinite(m_area))
            m_choice = Piecewise1D(areas);
        m_plane = findPlane();
        if (m_emission.texture && m_area > 0)
            m_meanFactor = meanFactor();
    }

    void sample(const V3f& p, float time, const V2f* u, int n, LightSample* out) const override {
        const M44f m = toWorld(time);
        for (int i = 0; i < n; ++i)
            out[i] = sampleOne(m, p, time, u[i]);
    }

    float pdf(const V3f&, float time, const V3f& wi, const LightHit* hit) const override {
        const WorldTriangle t = triangle(toWorld(time), hit->prim, time);
        return solidAnglePdf(hit->prim, t, sqr(hit->distance), wi);
    }

    bool mayIntersect(const V3f& p, float time, const V3f& wi) const override {
        const BoundingSphere sphere = bounds(time);
        if (!meetsSphere(sphere, p, wi))
            return false;
        if (!m_plane.valid)
            return true;
        const float height = dot(p - sphere.center, m_plane.n), fall = -dot(wi, m_plane.n);
        if (std::abs(height) <= kFlatness * 2 * sphere.radius)
            return true; // in the plane: cannot be told
        if (height * fall <= 0 || (height < 0 && !m_emission.twoSided))
            return false;
        const V3f crossing = p + wi * (height / fall) - sphere.center;
        // A crossing at a grazing angle is as uncertain as the plane is thick, over the cosine.
        const float margin = sphere.radius * (1e-3f + kFlatness * 2 / std::abs(fall));
        return length2(crossing) <= sqr(sphere.radius + margin);
    }

    float solidAngle(const V3f& p, float time) const override {
        const BoundingSphere sphere = bounds(time);
        if (m_plane.valid && !m_emission.twoSided &&
            dot(p - sphere.center, m_plane.n) < -kFlatness * 2 * sphere.radius)
            return 0;
        return sphereSolidAngle(sphere, p);
    }

  private:
    static constexpr float kFlatness = 1e-4f; ///< deviation from the plane, over the bounding radius

    WorldTriangle triangle(const M44f& m, uint32_t prim, float time) const {
        V3f v[3];
        triangleVertices(m_mesh, prim, time, v);
        for (V3f& p : v)
            p = transformPoint(m, p);
        const V3f e1 = v[1] - v[0], e2 = v[2] - v[0];
        return {v[0], e1, e2, cross(e1, e2)};
    }

    /// World area: of a moving or deforming mesh the mean at opening, middle and closing, so that a triangle
    /// that is only sometimes there is still drawn.
    float meanArea(uint32_t prim) const {
        const auto areaAt = [&](float t) { return length(triangle(toWorld(t), prim, t).cross) / 2; };
        return m_areasStay ? areaAt(0) : (areaAt(0) + areaAt(.5f) + areaAt(1)) / 3;
    }

    /// The vertex normal at barycentrics (u, v) of the second and third vertex, in object space.
    V3f vertexNormal(uint32_t prim, float time, float u, float v) const {
        const uint32_t* index = &m_mesh.indices[3 * size_t(prim)];
        const auto at = [&](const std::vector<V3f>& n) {
            return n[index[0]] * (1 - u - v) + n[index[1]] * u + n[index[2]] * v;
        };
        if (m_mesh.normals.size() == 1)
            return at(m_mesh.normals[0]);
        const float x = time * float(m_mesh.normals.size() - 1);
        const size_t i = std::min(size_t(std::max(x, 0.f)), m_mesh.normals.size() - 2);
        return lerp(at(m_mesh.normals[i]), at(m_mesh.normals[i + 1]), x - float(i));
    }

    /// +1 or -1: whether the surface's normal is along `t.cross` or against it. A mirroring transform turns
    /// the winding round but not the normal; vertex normals overrule the winding.
    float side(const M44f& m, uint32_t prim, float time, const WorldTriangle& t, float u, float v) const {
        const float mirrored = determinant3(m) < 0 ? -1.f : 1.f;
        float s = mirrored;
        if (!m_mesh.normals.empty()) {
            const V3f n = vertexNormal(prim, time, u, v);
            if (const float agree = dot(transformNormal(m.inverse(), n), t.cross); agree != 0)
                s = agree < 0 ? -1.f : 1.f;
        }
        return s * normalSign();
    }

    float solidAnglePdf(uint32_t prim, const WorldTriangle& t, float d2, const V3f& wi) const {
        const float twiceProjected = absDot(t.cross, wi); // 2 area |cosθ|
        const float pdf = m_choice.probability(prim) * 2 * d2 / twiceProjected;
        return twiceProjected > 0 && std::isfinite(pdf) ? pdf : 0;
    }

    LightSample sampleOne(const M44f& m, const V3f& p, float time, V2f u) const {
        const uint32_t prim = m_choice.sampleIndex(u.x, &u.x);
        const WorldTriangle t = triangle(m, prim, time);
        const V2f b = uniformTriangle(u);
        const V3f d = t.p0 - p + t.e1 * b.x + t.e2 * b.y;
        const float d2 = length2(d), distance = std::sqrt(d2);
        const V3f wi = d2 > 0 ? d * (1 / distance) : V3f(0, 0, 1);
        const float pdf = solidAnglePdf(prim, t, d2, wi);
        if (!(pdf > 0))
            return {wi, distance, Rgb(0), 0};
        const float cosine = -dot(t.cross, wi) * side(m, prim, time, t, b.x, b.y);
        const Rgb radiance = m_emission.towards(cosine);
        return {wi, distance,
                m_emission.texture && !isBlack(radiance) ? m_emission.at(queryAt(prim, b)) : radiance, pdf};
    }

    TextureQuery queryAt(uint32_t prim, const V2f& barycentrics) const {
        TextureQuery q;
        q.uv = triangleUv(m_mesh, prim, barycentrics.x, barycentrics.y);
        q.prim = prim, q.barycentrics = barycentrics;
        return q;
    }

    /// By a few hundred points, uniform by area: it decides how often the light is picked. Never 0, lest a
    /// light is not that is bright only between the points.
    Rgb meanFactor() const {
        constexpr int kSide = 16;
        constexpr float kLeast = 1e-3f;
        Rgb sum(0);
        for (int i = 0; i < kSide * kSide; ++i) {
            V2f u((i % kSide + .5f) / kSide, (i / kSide + .5f) / kSide);
            const uint32_t prim = m_choice.sampleIndex(u.x, &u.x);
            sum += m_emission.texture->rgb(queryAt(prim, uniformTriangle(u)));
        }
        return sum / float(kSide * kSide) + Rgb(kLeast);
    }

    Plane findPlane() const {
        Plane plane;
        if (!m_areasStay || !(m_area > 0))
            return plane;
        const M44f m = toWorld(0);
        const BoundingSphere sphere = bounds(0);
        for (uint32_t i = 0; i < m_mesh.triangleCount(); ++i) {
            const WorldTriangle t = triangle(m, i, 0);
            const float twice = length(t.cross);
            for (const V2f& corner : {V2f(0, 0), V2f(1, 0), V2f(0, 1)}) {
                const V3f p = t.p0 + t.e1 * corner.x + t.e2 * corner.y;
                if (twice > 0) {
                    const V3f n = t.cross * (side(m, i, 0, t, corner.x, corner.y) / twice);
                    if (plane.n == V3f(0))
                        plane.n = n;
                    if (dot(n, plane.n) < 1 - 1e-4f)
                        return {};
                }
                if (plane.n != V3f(0) &&
                    std::abs(dot(p - sphere.center, plane.n)) > kFlatness * sphere.radius)
                    return {};
            }
        }
        plane.valid = true;
        return plane;
    }

    const TriangleMesh& m_mesh;
    bool m_areasStay;
    Piecewise1D m_choice; ///< among triangles
    Plane m_plane;
};

} // namespace

std::shared_ptr<SurfaceLight> makeMeshLight(const PlacedShape& shape, const Emission& emission) {
    return std::make_shared<MeshLight>(shape, emission);
}

} // namespace strobe
