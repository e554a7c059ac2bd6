// The places of many hits in the lattice, side by side.
#pragma once

#include "core/math/hash.h"
#include "core/render/batch.h"
#include "lattice/mesh_cells.h"

#include <bit>

namespace strobe {

/// A surface, and the side it is seen from: that of its raw normal (winding, quadric), or the other.
struct LatticeFace {
    uint32_t instance, geometry;
    bool positive;
};

/// Of a triangle's first point, given those of the others.
inline float firstWeight(float second, float third) { return std::max(1 - second - third, 0.f); }

/// A mesh of the lattice: what lies between neighboring points.
struct LatticeCell {
    static constexpr int kPoints = 8; ///< at most
    enum Kind : uint8_t { Vertices, Grid, Lower, Upper, Rectangle };
    uint64_t key; ///< hits with the same key have the same points
    LatticeFace face;
    uint32_t prim;
    Kind kind;
    MeshCell lowest;    ///< of the eight of a Grid
    float i, j, nu, nv; ///< the mesh's place in a division of u by nu and v by nv

    int count() const { return pointsOf(kind); }
    static int pointsOf(Kind kind) { return kind == Grid ? 8 : kind == Rectangle ? 4 : 3; }
    /// The weights of the points for a hit at a place (LatticeSoA::place) in a cell, pointsOf(kind) of
    /// them; not negative, they add up to 1.
    static void weigh(Kind kind, const V3f& place, float weights[kPoints]) {
        const float x = place.x, y = place.y, z = place.z;
        if (kind != Grid && kind != Rectangle) {
            weights[0] = z, weights[1] = x, weights[2] = y;
            return;
        }
        weights[0] = (1 - x) * (1 - y), weights[1] = x * (1 - y), weights[2] = (1 - x) * y,
        weights[3] = x * y;
        if (kind == Grid)
            for (int k = 0; k < 4; ++k)
                weights[4 + k] = weights[k] * z, weights[k] *= 1 - z;
    }
    /// The point of the greatest of these weights.
    static int nearest(Kind kind, const V3f& place) {
        const float x = place.x, y = place.y, rest = 1 - x - y;
        if (kind == Grid || kind == Rectangle)
            return int(x > .5f) | int(y > .5f) << 1 | int(kind == Grid && place.z > .5f) << 2;
        return std::max(x, y) > rest ? 1 + int(y > x) : 0;
    }
};

/// Up to kSoAWidth hits on their way into the lattice.
struct LatticeSoA {
    int count = 0;
    HitSoA hit;
    V3SoA d; ///< of the rays, unit length
    alignas(64) float time[kSoAWidth];
    alignas(64) float width[kSoAWidth], spread[kSoAWidth]; ///< of the cones of the pixels
    void add(const Hit& hit, const V3f& direction, float time, const RayCone& pixel);
    // Fetched for these:
    V3SoA a, b; ///< world-space edges from a triangle's first vertex; or a quadric's derivatives
    alignas(64) uint64_t keySum[kSoAWidth]; ///< of what the cell's key is of, begun: face and primitive
    alignas(64) int32_t toPlace[kSoAWidth]; ///< the edges are not yet placed in the world
    bool bends[kSoAWidth];                  ///< it is a quadric, of which the ray
    bool seesFront[kSoAWidth];              ///< sees the side of its own normal
    // Found from all of these:
    alignas(64) float block[kSoAWidth];      ///< the size of a block at the hit, in scene units
    alignas(64) int32_t positive[kSoAWidth]; ///< see LatticeFace
    alignas(64) int32_t kind[kSoAWidth];     ///< of LatticeCell
    alignas(64) float i[kSoAWidth], j[kSoAWidth], nu[kSoAWidth], nv[kSoAWidth];
    /// In the cell. In a triangle: the weights of its second point, third and first; else how far from the
    /// lowest point to the highest.
    V3SoA place;
    alignas(64) float normal2[kSoAWidth]; ///< the squared length of twice the triangle's area
    alignas(64) uint64_t key[kSoAWidth];
    int32_t inGrid[kSoAWidth]; ///< of those whose kind is Grid: the lane of `grid`
    MeshCellSoA grid;

    /// Divides them all, as triangles, by blocks of so many pixels; those smaller than a block become
    /// Vertices if they share. Returns whether some did.
    bool divideTriangles(float blockSize, bool sharesSmall);
    void divideQuadric(int lane, bool isPositive);
    /// Completes `key`, but for those in a Grid.
    void mixKeys();
};

/// A point of the lattice: a place on a primitive, or a vertex of a mesh.
struct LatticePoint {
    uint32_t prim = kNone; ///< of the face's geometry, or the vertex; kNone: no point
    float u = 0, v = 0;    ///< a triangle's barycentrics, or a quadric's numbers
    bool isVertex = false; ///< LatticeSurface::placeOf knows where
    uint64_t keySum = 0;   ///< see SurfaceLattice::keyOf

    explicit operator bool() const { return prim != kNone; }
};

/// The three points of each of some cells of divided triangles, side by side.
struct TrianglePointSoA {
    int count = 0;
    int32_t lane[kSoAWidth]; ///< of the LatticeSoA where a cell's hit is
    alignas(64) float i[kSoAWidth]{}, j[kSoAWidth]{}, nu[kSoAWidth]{}, nv[kSoAWidth]{};
    alignas(64) int32_t isUpper[kSoAWidth]{}, positive[kSoAWidth]{};
    alignas(64) uint64_t keySum[kSoAWidth]{};
    // Found:
    struct Points {
        alignas(64) float u[kSoAWidth], v[kSoAWidth];
        alignas(64) int32_t corner[kSoAWidth]; ///< of the triangle, whose vertex it is; negative: none
        alignas(64) uint32_t prim[kSoAWidth];
        alignas(64) uint64_t keySum[kSoAWidth];
        LatticePoint at(int i) const { return {prim[i], u[i], v[i], corner[i] >= 0, keySum[i]}; }
    };
    Points points[3];

    /// Adds the cell of a hit that was located.
    void push(const LatticeSoA& from, int at);
    /// Finds the first `each` points of all, as if corners belonged to their triangle alone.
    void find(int each);
    /// The keys of points number k in the eras that begin with these time bins (SurfaceLattice::keyOf).
    void mixKeys(int k, const uint32_t* firstBin, uint64_t* keys) const;
};

/// The time bins, out of so many, of shutter fractions.
void findTimeBins(const float* time, int n, int bins, uint32_t* bin);

/// What a key is of. Keys of cells and of points are never compared. A cell's kind is added to kCellKey.
enum LatticeKeyKind : uint64_t { kVertexKey = 1, kSurfaceKey = 2, kGridKey = 3, kCellKey = 4 };

inline uint64_t latticeFloatBits(float a, float b) {
    return uint64_t(std::bit_cast<uint32_t>(a)) << 32 | std::bit_cast<uint32_t>(b);
}
inline uint64_t latticeItem(uint32_t item, uint64_t kind, bool positive) {
    return uint64_t(item) << 8 | kind << 1 | uint64_t(positive);
}

} // namespace strobe
