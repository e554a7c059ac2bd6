// Hits in the lattice, and cells of divided triangles, as structures of arrays.
#pragma once

#include "core/render/batch.h"
#include "lattice/lattice_cell.h"

namespace strobe {

struct RayConeSoA {
    alignas(64) float width[kSoAWidth], spread[kSoAWidth];
    void set(int i, const RayCone& cone) {
        width[i] = cone.width;
        spread[i] = cone.spread;
    }
};

/// Up to kSoAWidth hits and their cells. SurfaceLattice::locate computes all but the first group of members.
struct LatticeHitSoA {
    // Input:
    int count = 0;
    HitSoA hit;
    V3SoA d; ///< unit directions of the rays
    alignas(64) float time[kSoAWidth];
    RayConeSoA cone; ///< of the pixel
    /// Precondition: count < kSoAWidth.
    void push_back(const Hit& hit, const V3f& direction, float time, const RayCone& pixelCone);

    // Of the surface:
    V3SoA a, b; ///< world-space edges from the first vertex of the triangle, or derivatives of the quadric
    alignas(64) uint64_t keySum[kSoAWidth];        ///< the part of the cell's key from geometry and primitive
    alignas(64) int32_t needsTransform[kSoAWidth]; ///< a and b are not in world space yet
    bool isQuadric[kSoAWidth];
    bool seesQuadricFront[kSoAWidth];

    // Of the cell:
    alignas(64) float blockSize[kSoAWidth];       ///< at the hit, in scene units
    alignas(64) int32_t isFront[kSoAWidth];       ///< see SurfaceSide
    alignas(64) int32_t kind[kSoAWidth];          ///< LatticeCell::Kind
    alignas(64) float i[kSoAWidth], j[kSoAWidth]; ///< see GridPosition
    alignas(64) float nu[kSoAWidth], nv[kSoAWidth];
    /// Coordinates in the cell. Triangular cells: weights of the second, third and first point. Others:
    /// position between the lowest and the highest point, in [0,1] along each axis.
    V3SoA coords;
    alignas(64) float normal2[kSoAWidth]; ///< see DividedTriangle
    alignas(64) uint64_t key[kSoAWidth];  ///< LatticeCell::key
    int32_t meshCell[kSoAWidth];          ///< Grid: index into meshCells
    MeshCellSoA meshCells;

    /// Divides all hits as hits of triangles. `blockSizeInPixels` is the parameter blocksize. With
    /// `sharesSmall`, triangles too small to be divided become Vertices; returns whether there are any.
    bool divideTriangles(float blockSizeInPixels, bool sharesSmall);
    /// Divides hit i as a hit of a quadric, after divideTriangles.
    void divideQuadric(int i);
    /// Writes `key`, except for cells of kind Grid.
    void computeKeys();
};

/// Up to kSoAWidth cells of divided triangles, each of three points. The first is the node (i, j) of the
/// grid, or (i + 1, j + 1) of an upper cell; the second is (i + 1, j), the third is (i, j + 1).
struct TriangleCellSoA {
    int count = 0;
    int32_t hit[kSoAWidth]; ///< index of a hit in the cell
    alignas(64) float i[kSoAWidth]{}, j[kSoAWidth]{}, nu[kSoAWidth]{}, nv[kSoAWidth]{};
    alignas(64) int32_t isUpper[kSoAWidth]{}, isFront[kSoAWidth]{};
    alignas(64) uint64_t keySum[kSoAWidth]{};

    /// One point of each cell.
    struct Points {
        alignas(64) float u[kSoAWidth], v[kSoAWidth];
        alignas(64) int32_t corner[kSoAWidth]; ///< 0 to 2: the triangle's vertex at the point; negative: none
        alignas(64) uint32_t prim[kSoAWidth];
        alignas(64) uint64_t keySum[kSoAWidth];
        LatticePoint at(int c) const { return {prim[c], u[c], v[c], corner[c] >= 0, keySum[c]}; }
    };
    Points points[3];

    /// Appends the cell of hit number `h` of located hits.
    void push_back(const LatticeHitSoA& hits, int h);
    /// Computes the first `pointsPerCell` points of all cells, as if no vertex were shared with other
    /// triangles.
    void computePoints(int pointsPerCell);
    /// Writes SurfaceLattice::keyOf of point number k of each cell, in time bin firstBin[cell].
    void computeKeys(int k, const uint32_t* firstBin, uint64_t* keys) const;
};

/// Writes the time bins, out of `bins`, of n shutter fractions.
void findTimeBins(const float* time, int n, int bins, uint32_t* bin);

} // namespace strobe
