// The interface of shapes. A shape is either a triangle mesh, which Embree reads in place, or a quadric.
#pragma once

#include "core/interfaces/texture.h"
#include "core/math/api.h"
#include "core/math/soa.h"

#include <memory>
#include <vector>

namespace STROBE_API strobe {

/// A triangle mesh in object space, static or deforming. All per-vertex arrays have the same indices.
struct TriangleMesh {
    /// A side of the surface. The vertices of a triangle are counterclockwise as seen from its front.
    enum class Side : uint8_t { None, Front, Back };

    std::vector<uint32_t> indices;           ///< three per triangle
    std::vector<std::vector<V3f>> positions; ///< one array per key; a single key: static
    std::vector<std::vector<V3f>> normals;   ///< empty, or one array per key; need not have unit length
    std::vector<V3f> tangents;               ///< empty, or one per vertex
    std::vector<V2f> uvs;         ///< empty (each triangle has (0,0) (1,0) (1,1)), or one per vertex
    std::vector<float> keyTimes;  ///< scene times of the keys, ascending; empty if static
    FloatInput alpha{1};          ///< opacity; below 1, the surface is stochastically transparent
    bool isSphere = false;        ///< replaces a sphere of pbrt
    Side culledSide = Side::None; ///< the side that camera rays do not hit

    /// Returns whether rays never hit the mesh. As an area light it illuminates nevertheless.
    bool isInvisible() const { return !alpha.texture && alpha.constant <= 0; }
    bool isOpaque() const { return !alpha.texture && alpha.constant >= 1; }
    size_t triangleCount() const { return indices.size() / 3; }
    size_t vertexCount() const { return positions.empty() ? 0 : positions.front().size(); }
    bool deforms() const { return positions.size() > 1; }
};

/// A point on a quadric, in object space.
struct QuadricPoint {
    V3f p, n;       ///< n is the unit outward normal
    V3f dpdu, dpdv; ///< partial derivatives of p by uv
    V2f uv;         ///< in the parameterization of pbrt
};

/// References to arrays of the members of QuadricPoint.
struct QuadricPointSoA {
    V3SoA &p, &n, &dpdu, &dpdv;
    V2SoA& uv;
};

/// Rays in the object space of a quadric, as a structure of arrays. Directions need not have unit length.
struct QuadricRaySoA {
    static constexpr int kMax = 16;
    int n; ///< number of rays, at most kMax

    /// Transforms rays first … first+count-1 of an Embree packet. `rows` are the rows of the packet, of
    /// `packet` floats each, in Embree's order: origin (3 rows), tmin, direction (3 rows), time, tmax.
    QuadricRaySoA(const M44f& toObject, const float* rows, unsigned packet, unsigned first, unsigned count);
    V3f o(int i) const { return {ox[i], oy[i], oz[i]}; }
    V3f d(int i) const { return {dx[i], dy[i], dz[i]}; }
    alignas(64) float ox[kMax], oy[kMax], oz[kMax], dx[kMax], dy[kMax], dz[kMax];
    alignas(64) float tmin[kMax], tmax[kMax];
};

/// Interface of shapes that are intersected in closed form. Quadrics are immutable, and all functions are
/// thread-safe. Everything is in object space. The default SoA functions call the scalar functions; overrides
/// must return the same bits.
class Quadric {
  public:
    virtual ~Quadric() = default;
    virtual Box3f bounds() const = 0;

    /// Finds the nearest intersection of o + t d with tmin < t < tmax; d need not have unit length. Returns
    /// false if there is none. Else writes t and the surface parameters (u, v) for `point`.
    virtual bool intersect(const V3f& o, const V3f& d, float tmin, float tmax, float& t, float& u,
                           float& v) const = 0;
    /// Intersects the rays with hit[i] != 0, and sets hit[i] to 0 if ray i has no intersection. t, u and v
    /// are undefined for rays without an intersection. Same results as `intersect`, to the bit.
    virtual void intersectSoA(const QuadricRaySoA& rays, int32_t* hit, float* t, float* u, float* v) const;

    /// Evaluates the parameterization at (u, v), as written by `intersect`: position, normal and partial
    /// derivatives.
    virtual QuadricPoint point(float u, float v) const = 0;
    /// Evaluates points begin … end-1; same results as `point`, to the bit.
    virtual void pointSoA(const float* u, const float* v, int begin, int end, QuadricPointSoA& out) const;

    virtual float area() const = 0;
    /// Samples the surface uniformly by area (density 1/area()); u in [0,1)².
    virtual QuadricPoint samplePoint(const V2f& u) const = 0;
    /// Samples n <= kSoAWidth points; positions and normals are the same as of samplePoint, to the bit.
    virtual void samplePointSoA(const V2SoA& u, int n, V3SoA& p, V3SoA& normal) const;

    /// Returns the radius if the shape is a complete sphere around the origin, else 0. Lights sample complete
    /// spheres by solid angle.
    virtual float wholeSphereRadius() const { return 0; }
};

/// Intersects a packet with a quadric and calls onHit(i, t, u, v) for each ray i that hits it. `rows` is as
/// for QuadricRaySoA. Rays with valid[i] == 0 are skipped.
template <class OnHit>
void intersectPacket(const Quadric& quadric, const M44f& toObject, const int* valid, const float* rows,
                     unsigned packet, const OnHit& onHit) {
    for (unsigned first = 0; first < packet; first += QuadricRaySoA::kMax) {
        const QuadricRaySoA rays(toObject, rows, packet, first,
                                 std::min(packet - first, unsigned(QuadricRaySoA::kMax)));
        alignas(64) int32_t hit[QuadricRaySoA::kMax];
        alignas(64) float t[QuadricRaySoA::kMax], u[QuadricRaySoA::kMax], v[QuadricRaySoA::kMax];
        std::copy_n(valid + first, rays.n, hit);
        quadric.intersectSoA(rays, hit, t, u, v);
        for (int i = 0; i < rays.n; ++i)
            if (hit[i])
                onHit(first + unsigned(i), t[i], u[i], v[i]);
    }
}

/// The result of a shape plugin's `create`. Exactly one member is set.
struct Shape {
    std::shared_ptr<TriangleMesh> mesh;
    std::shared_ptr<const Quadric> quadric;
};

} // namespace strobe
