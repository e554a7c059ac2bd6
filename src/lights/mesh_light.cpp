#include "lights/mesh_light.h"

#include "core/math/sampling.h"
#include "lights/placement.h"

namespace strobe {

namespace {

/// A triangle in world space.
struct WorldTriangle {
    V3f p0, e1, e2;
    V3f cross; ///< e1 x e2: its length is twice the area; along the surface normal or opposite to it
};

/// The plane of a static, flat mesh whose triangles all face the same side.
struct Plane {
    V3f n{0}; ///< surface normal
    bool valid = false;
};

class MeshLight final : public SurfaceLight {
  public:
    MeshLight(const PlacedShape& shape, const Emission& emission)
        : SurfaceLight(shape, emission), m_mesh(*m_shape.shape.mesh),
          m_hasStaticAreas(m_isStatic && !m_mesh.deforms()) {
        std::vector<float> areas(m_mesh.triangleCount());
        for (uint32_t i = 0; i < areas.size(); ++i)
            areas[i] = meanArea(i);
        double sum = 0;
        for (const float a : areas)
            sum += a;
        m_area = float(sum);
        if (m_area > 0 && std::isfinite(m_area))
            m_triangles = Piecewise1D(areas);
        m_plane = findPlane();
        if (m_emission.texture && m_area > 0)
            m_meanTexture = meanTexture();
    }

    void sample(const V3f& p, float time, const V2f* u, int n, LightSample* out) const override {
        const M44f m = toWorld(time);
        for (int i = 0; i < n; ++i)
            out[i] = sampleOne(m, p, time, u[i]);
    }

    float pdf(const V3f&, float time, const V3f& wi, const LightHit* hit) const override {
        const WorldTriangle t = triangle(toWorld(time), hit->prim, time);
        return solidAnglePdf(m_triangles.probability(hit->prim), t, sqr(hit->distance), wi);
    }

    bool mayIntersect(const V3f& p, float time, const V3f& wi) const override {
        const BoundingSphere sphere = bounds(time);
        if (m_mesh.isInvisible() || !mayIntersectSphere(sphere, p, wi))
            return false;
        if (!m_plane.valid)
            return true;
        const float height = dot(p - sphere.center, m_plane.n), descent = -dot(wi, m_plane.n);
        if (std::abs(height) <= kFlatness * 2 * sphere.radius)
            return true; // p is in the plane, up to rounding
        if (height * descent <= 0 || (height < 0 && !m_emission.twoSided))
            return false;
        const V3f crossing = p + wi * (height / descent) - sphere.center;
        // The uncertainty of the crossing is the thickness of the plane over the cosine.
        const float margin = sphere.radius * (1e-3f + kFlatness * 2 / std::abs(descent));
        return length2(crossing) <= sqr(sphere.radius + margin);
    }

    float solidAngle(const V3f& p, float time) const override {
        if (m_mesh.isInvisible())
            return 0; // rays cannot hit it
        const BoundingSphere sphere = bounds(time);
        if (m_plane.valid && !m_emission.twoSided &&
            dot(p - sphere.center, m_plane.n) < -kFlatness * 2 * sphere.radius)
            return 0;
        return sphereSolidAngle(sphere, p);
    }

    uint32_t emitterCount() const override { return isOneEmitter() ? 1 : uint32_t(m_mesh.triangleCount()); }
    std::optional<EmitterBounds> emitterBounds(uint32_t emitter, float begin, float end) const override {
        return isOneEmitter() ? SurfaceLight::emitterBounds(0, begin, end)
                              : triangleBounds(emitter, begin, end);
    }
    LightSample sampleEmitter(uint32_t emitter, const V3f& p, float time, const V2f& u) const override {
        return isOneEmitter() ? sampleOne(toWorld(time), p, time, u)
                              : sampleTriangle(toWorld(time), emitter, 1, p, time, u);
    }
    float emitterPdf(uint32_t emitter, const V3f& p, float time, const V3f& wi,
                     const LightHit* hit) const override {
        if (isOneEmitter())
            return pdf(p, time, wi, hit);
        return solidAnglePdf(1, triangle(toWorld(time), emitter, time), sqr(hit->distance), wi);
    }

  protected:
    V3f normalAt(float) const override { return m_plane.n; }

  private:
    /// Returns whether the light tree has one leaf for the whole light.
    bool isOneEmitter() const { return m_plane.valid && m_mesh.triangleCount() <= 2; }

    static constexpr float kFlatness = 1e-4f; ///< largest distance from the plane / bounding radius

    WorldTriangle triangle(const M44f& m, uint32_t prim, float time) const {
        V3f v[3];
        triangleVertices(m_mesh, prim, time, v);
        for (V3f& p : v)
            p = transformPoint(m, p);
        const V3f e1 = v[1] - v[0], e2 = v[2] - v[0];
        return {v[0], e1, e2, cross(e1, e2)};
    }

    /// Returns the world-space area; for a moving or deforming mesh the mean at shutter opening, middle and
    /// closing, so that a triangle that is temporarily degenerate is still drawn.
    float meanArea(uint32_t prim) const {
        const auto areaAt = [&](float t) { return length(triangle(toWorld(t), prim, t).cross) / 2; };
        return m_hasStaticAreas ? areaAt(0) : (areaAt(0) + areaAt(.5f) + areaAt(1)) / 3;
    }

    /// Returns the interpolated vertex normal in object space; (u, v): barycentrics of the second and third
    /// vertex.
    V3f vertexNormal(uint32_t prim, float time, float u, float v) const {
        const uint32_t* index = &m_mesh.indices[3 * size_t(prim)];
        const auto interpolate = [&](const std::vector<V3f>& n) {
            return n[index[0]] * (1 - u - v) + n[index[1]] * u + n[index[2]] * v;
        };
        if (m_mesh.normals.size() == 1)
            return interpolate(m_mesh.normals[0]);
        const float x = time * float(m_mesh.normals.size() - 1);
        const size_t i = std::min(size_t(std::max(x, 0.f)), m_mesh.normals.size() - 2);
        return lerp(interpolate(m_mesh.normals[i]), interpolate(m_mesh.normals[i + 1]), x - float(i));
    }

    /// Returns +1 if the surface normal is along `t.cross`, -1 if it is opposite. A mirroring transform flips
    /// the winding but not the normal. Vertex normals take precedence over the winding.
    float normalSide(const M44f& m, uint32_t prim, float time, const WorldTriangle& t, float u,
                     float v) const {
        float s = determinant3(m) < 0 ? -1.f : 1.f;
        if (!m_mesh.normals.empty()) {
            const V3f n = vertexNormal(prim, time, u, v);
            if (const float d = dot(transformNormal(m.inverse(), n), t.cross); d != 0)
                s = d < 0 ? -1.f : 1.f;
        }
        return s * normalSign();
    }

    /// Returns the density per solid angle of sampling direction `wi` on triangle `t`, which is chosen with
    /// this probability, at squared distance d2.
    static float solidAnglePdf(float probability, const WorldTriangle& t, float d2, const V3f& wi) {
        const float twiceProjectedArea = absDot(t.cross, wi); // 2 area |cosθ|
        const float pdf = probability * 2 * d2 / twiceProjectedArea;
        return twiceProjectedArea > 0 && std::isfinite(pdf) ? pdf : 0;
    }

    LightSample sampleOne(const M44f& m, const V3f& p, float time, V2f u) const {
        const uint32_t prim = m_triangles.sampleIndex(u.x, &u.x);
        return sampleTriangle(m, prim, m_triangles.probability(prim), p, time, u);
    }

    /// Samples a triangle that was chosen with this probability.
    LightSample sampleTriangle(const M44f& m, uint32_t prim, float probability, const V3f& p, float time,
                               const V2f& u) const {
        const WorldTriangle t = triangle(m, prim, time);
        const V2f b = uniformTriangle(u);
        const V3f d = t.p0 - p + t.e1 * b.x + t.e2 * b.y;
        const float d2 = length2(d), distance = std::sqrt(d2);
        const V3f wi = d2 > 0 ? d * (1 / distance) : V3f(0, 0, 1);
        const float pdf = solidAnglePdf(probability, t, d2, wi);
        if (!(pdf > 0))
            return {wi, distance, Rgb(0), 0};
        const float cosine = -dot(t.cross, wi) * normalSide(m, prim, time, t, b.x, b.y);
        const Rgb radiance = m_emission.towards(cosine);
        return {wi, distance,
                m_emission.texture && !isBlack(radiance) ? m_emission.at(queryAt(prim, b)) : radiance, pdf};
    }

    TextureQuery queryAt(uint32_t prim, const V2f& barycentrics) const {
        TextureQuery q;
        q.uv = triangleUv(m_mesh, prim, barycentrics.x, barycentrics.y);
        q.prim = prim;
        q.barycentrics = barycentrics;
        return q;
    }

    /// Returns the pose of a triangle. Sets `isTwoSided` if vertex normals disagree on its side.
    EmitterPose trianglePose(uint32_t prim, float time, bool& isTwoSided) const {
        const M44f m = toWorld(time);
        const WorldTriangle t = triangle(m, prim, time);
        const V3f center = t.p0 + (t.e1 + t.e2) * (1 / 3.f);
        float radius2 = 0, side = 0;
        for (const V2f& b : {V2f(0, 0), V2f(1, 0), V2f(0, 1)}) {
            radius2 = std::max(radius2, length2(t.p0 + t.e1 * b.x + t.e2 * b.y - center));
            const float s = normalSide(m, prim, time, t, b.x, b.y);
            isTwoSided |= side * s < 0;
            side = s;
        }
        const float rounding = 1e-6f * (std::abs(center.x) + std::abs(center.y) + std::abs(center.z));
        return {center, std::sqrt(radius2) * (1 + 1e-5f) + rounding, normalizeAny(t.cross * side), 0};
    }

    std::optional<EmitterBounds> triangleBounds(uint32_t prim, float begin, float end) const {
        const int keys = std::max(m_isStatic ? 1 : m_shape.motion->keyCount(), int(m_mesh.positions.size()));
        EmitterBounds result;
        result.isTwoSided = m_emission.twoSided;
        bool isDegenerate = false;
        const auto poseAt = [&](float time) {
            const EmitterPose pose = trianglePose(prim, time, result.isTwoSided);
            isDegenerate |= pose.axis == V3f(0);
            return pose;
        };
        boundPoses(posesOf(keys, begin, end, poseAt), result);
        if (isDegenerate)
            result.spread = kPi;
        const float area = m_triangles.probability(prim) * m_area;
        result.intensity = rootMeanSquare(m_emission.radiance * triangleTexture(prim)) * area;
        return result;
    }

    /// Returns the mean of the emission texture at some points of a triangle, plus a share of the mean of the
    /// whole light, so that it is never 0.
    Rgb triangleTexture(uint32_t prim) const {
        if (!m_emission.texture)
            return Rgb(1);
        constexpr float kShare = .05f;
        Rgb sum(0);
        for (const V2f& b : {V2f(1 / 3.f, 1 / 3.f), V2f(.1f, .1f), V2f(.8f, .1f), V2f(.1f, .8f)})
            sum += m_emission.texture->rgb(queryAt(prim, b));
        return sum * .25f + m_meanTexture * kShare;
    }

    /// Returns the mean of the texture at 256 points that are uniform by area. It determines how often the
    /// light is selected, so it is never 0: the texture may be bright between the points only.
    Rgb meanTexture() const {
        constexpr int kSide = 16;
        constexpr float kMin = 1e-3f;
        Rgb sum(0);
        for (int i = 0; i < kSide * kSide; ++i) {
            V2f u((i % kSide + .5f) / kSide, (i / kSide + .5f) / kSide);
            const uint32_t prim = m_triangles.sampleIndex(u.x, &u.x);
            sum += m_emission.texture->rgb(queryAt(prim, uniformTriangle(u)));
        }
        return sum / float(kSide * kSide) + Rgb(kMin);
    }

    /// Returns the plane of the mesh, not valid if it is not flat or not static.
    Plane findPlane() const {
        Plane plane;
        if (!m_hasStaticAreas || !(m_area > 0))
            return plane;
        const M44f m = toWorld(0);
        const BoundingSphere sphere = bounds(0);
        for (uint32_t i = 0; i < m_mesh.triangleCount(); ++i) {
            const WorldTriangle t = triangle(m, i, 0);
            const float twiceArea = length(t.cross);
            for (const V2f& corner : {V2f(0, 0), V2f(1, 0), V2f(0, 1)}) {
                const V3f p = t.p0 + t.e1 * corner.x + t.e2 * corner.y;
                if (twiceArea > 0) {
                    const V3f n = t.cross * (normalSide(m, i, 0, t, corner.x, corner.y) / twiceArea);
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
    bool m_hasStaticAreas;
    Piecewise1D m_triangles; ///< by area
    Plane m_plane;
};

} // namespace

std::shared_ptr<SurfaceLight> makeMeshLight(const PlacedShape& shape, const Emission& emission) {
    return std::make_shared<MeshLight>(shape, emission);
}

} // namespace strobe
