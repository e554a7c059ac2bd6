// The shape seam. A shape is either a triangle mesh (plain data that Embree reads in place) or a quadric.
#pragma once

#include "core/interfaces/texture.h"
#include "core/math/soa.h"

#include <memory>
#include <vector>

namespace strobe {

/// A triangle mesh in object space, still or deforming. All per-vertex arrays are indexed alike.
struct TriangleMesh {
    std::vector<uint32_t> indices;           ///< three per triangle
    std::vector<std::vector<V3f>> positions; ///< one array per key; one key: still
    std::vector<std::vector<V3f>> normals;   ///< empty, or one array per key of `positions`; need not be unit
    std::vector<V3f> tangents;               ///< empty, or per vertex
    std::vector<V2f> uvs;                    ///< empty: each triangle has (0,0) (1,0) (1,1)
    std::vector<float> keyTimes;             ///< scene time of each key, ascending; empty when still
    FloatInput alpha{1};                     ///< < 1: partly (stochastically) or wholly cut away

    size_t triangleCount() const { return indices.size() / 3; }
    size_t vertexCount() const { return positions.empty() ? 0 : positions.front().size(); }
    bool deforms() const { return positions.size() > 1; }
};

/// A point on a quadric, in its object space.
struct QuadricPoint {
    V3f p, n;       ///< n: unit outward normal
    V3f dpdu, dpdv; ///< derivatives by the uv below
    V2f uv;         ///< pbrt's parametrization
};

/// Where QuadricPoints go that are found side by side.
struct QuadricPointSoA {
    V3SoA &p, &n, &dpdu, &dpdv;
    V2SoA& uv;
};

/// Rays side by side, in a quadric's object space; directions of any length.
struct QuadricRaySoA {
    static constexpr int kMax = 16;
    int n; ///< at most kMax

    /// Takes rays `first` to `first + count` of a packet of `packet` rays, which is rows of that many numbers
    /// in Embree's order: origin, tmin, direction, time, tmax.
    QuadricRaySoA(const M44f& toObject, const float* rows, unsigned packet, unsigned first, unsigned count);
    V3f o(int i) const { return {ox[i], oy[i], oz[i]}; }
    V3f d(int i) const { return {dx[i], dy[i], dz[i]}; }
    alignas(64) float ox[kMax], oy[kMax], oz[kMax], dx[kMax], dy[kMax], dz[kMax];
    alignas(64) float tmin[kMax], tmax[kMax];
};

/// A shape intersected in closed form, in its object space.
class Quadric {
  public:
    virtual ~Quadric() = default;
    virtual Box3f bounds() const = 0;
    /// The nearest hit with tmin < t < tmax of o + t d (d of any length). On success fills t and the two
    /// numbers (u, v) that `point` needs.
    virtual bool intersect(const V3f& o, const V3f& d, float tmin, float tmax, float& t, float& u,
                           float& v) const = 0;
    /// The same for many rays: hit[i] says whether ray i is asked for, and then, whether it hits. What t, u
    /// and v of others become does not matter.
    virtual void intersectSoA(const QuadricRaySoA& rays, int32_t* hit, float* t, float* u, float* v) const;
    /// The surface at (u, v) of `intersect`.
    virtual QuadricPoint point(float u, float v) const = 0;
    /// Those at (u[i], v[i]), i from `begin` to `end`.
    virtual void pointSoA(const float* u, const float* v, int begin, int end, QuadricPointSoA& out) const;
    virtual float area() const = 0;
    /// A point uniform by area from u in [0,1)²: `point` plus nothing else; density 1/area().
    virtual QuadricPoint samplePoint(const V2f& u) const = 0;
    /// Its p and n for u 0 … n-1.
    virtual void samplePointSoA(const V2SoA& u, int n, V3SoA& p, V3SoA& normal) const;
    /// The radius when the shape is a whole sphere about the origin (seen as a cone by lights), else 0.
    virtual float wholeSphereRadius() const { return 0; }
};

/// Calls met(i, t, u, v) for those rays of a packet (rows as for QuadricRaySoA; valid[i] is 0 for rays to
/// leave out) that hit the quadric.
template <class Met>
void intersectPacket(const Quadric& quadric, const M44f& toObject, const int* valid, const float* rows,
                     unsigned packet, const Met& met) {
    for (unsigned first = 0; first < packet; first += QuadricRaySoA::kMax) {
        const QuadricRaySoA rays(toObject, rows, packet, first,
                                 std::min(packet - first, unsigned(QuadricRaySoA::kMax)));
        alignas(64) int32_t hit[QuadricRaySoA::kMax];
        alignas(64) float t[QuadricRaySoA::kMax], u[QuadricRaySoA::kMax], v[QuadricRaySoA::kMax];
        std::copy_n(valid + first, rays.n, hit);
        quadric.intersectSoA(rays, hit, t, u, v);
        for (int i = 0; i < rays.n; ++i)
            if (hit[i])
                met(first + unsigned(i), t[i], u[i], v[i]);
    }
}

/// What a shape plugin makes: exactly one of the two is set.
struct Shape {
    std::shared_ptr<TriangleMesh> mesh;
    std::shared_ptr<const Quadric> quadric;
};

} // namespace strobe
