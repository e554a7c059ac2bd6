// The cells and the points of the lattice.
#pragma once

#include "core/math/hash.h"
#include "lattice/mesh_cells.h"

#include <bit>

namespace strobe {

/// A side of a geometry. The front is the side of the normal that the winding of a triangle or the
/// parameterization of a quadric gives, whatever the geometry's orientation.
struct SurfaceSide {
    uint32_t instance, geometry;
    bool isFront;
};

/// Returns the weight of the first vertex of a triangle, given those of the others.
inline float firstWeight(float second, float third) { return std::max(1 - second - third, 0.f); }

/// A cell of the lattice: the region between neighboring lattice points.
struct LatticeCell {
    static constexpr int kMaxPoints = 8;
    enum Kind : uint8_t {
        Vertices,  ///< an undivided triangle; its vertices are the points
        Grid,      ///< eight neighboring mesh cells (MeshCells)
        Lower,     ///< the lower or
        Upper,     ///< the upper triangle of a cell of a divided triangle (GridPosition)
        Rectangle, ///< a cell of a divided quadric
    };
    uint64_t key; ///< hits with equal keys have the same points
    SurfaceSide side;
    uint32_t prim;
    Kind kind;
    MeshCell lowest;    ///< Grid: the lowest of the eight mesh cells
    float i, j, nu, nv; ///< Lower, Upper, Rectangle: see GridPosition

    int pointCount() const { return pointCountOf(kind); }
    static int pointCountOf(Kind kind) { return kind == Grid ? 8 : kind == Rectangle ? 4 : 3; }
    /// Writes the weights of the pointCountOf(kind) points for a hit at `coords` (LatticeHitSoA::coords).
    /// They are not negative and sum to 1.
    static void computeWeights(Kind kind, const V3f& coords, float weights[kMaxPoints]) {
        const float x = coords.x, y = coords.y, z = coords.z;
        if (kind != Grid && kind != Rectangle) {
            weights[0] = z;
            weights[1] = x;
            weights[2] = y;
            return;
        }
        weights[0] = (1 - x) * (1 - y);
        weights[1] = x * (1 - y);
        weights[2] = (1 - x) * y;
        weights[3] = x * y;
        if (kind == Grid) {
            for (int k = 0; k < 4; ++k) {
                weights[4 + k] = weights[k] * z;
                weights[k] *= 1 - z;
            }
        }
    }
    /// Returns the number of the point with the greatest of these weights.
    static int nearestPoint(Kind kind, const V3f& coords) {
        const float x = coords.x, y = coords.y, rest = 1 - x - y;
        if (kind == Grid || kind == Rectangle)
            return int(x > .5f) | int(y > .5f) << 1 | int(kind == Grid && coords.z > .5f) << 2;
        return std::max(x, y) > rest ? 1 + int(y > x) : 0;
    }
};

/// A lattice point: a position on a primitive, or a vertex of a mesh.
struct LatticePoint {
    uint32_t prim = kNone; ///< of the geometry; the vertex if `isVertex`; kNone: no point
    float u = 0, v = 0;    ///< as Hit::u and v
    bool isVertex = false; ///< its position is LatticeSurface::meshPointOf
    uint64_t keySum = 0;   ///< see SurfaceLattice::keyOf

    explicit operator bool() const { return prim != kNone; }
};

/// The kind of item that a key identifies. Keys of cells are never compared with keys of points.
/// LatticeCell::Kind is added to kCellKey.
enum LatticeKeyKind : uint64_t { kVertexKey = 1, kSurfaceKey = 2, kGridKey = 3, kCellKey = 4 };

inline uint64_t latticeKeyItem(uint32_t item, uint64_t kind, bool isFront) {
    return uint64_t(item) << 8 | kind << 1 | uint64_t(isFront);
}
inline uint64_t latticeFloatBits(float a, float b) {
    return uint64_t(std::bit_cast<uint32_t>(a)) << 32 | std::bit_cast<uint32_t>(b);
}

} // namespace strobe
