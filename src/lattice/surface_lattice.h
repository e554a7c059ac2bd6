// The lattice: canonical points on every surface, from which samples interpolate.
#pragma once

#include "core/render/integrator.h"
#include "lattice/lattice_patch.h"
#include "lattice/surface_cache.h"

#include <unordered_map>

namespace strobe {

/// Up to kSoAWidth shades of lattice points, as seen by the camera through points of its lens.
struct ShadeSoA {
    // Input:
    int count = 0;
    HitSoA hit; ///< without t; prim is the vertex if isVertex
    bool isVertex[kSoAWidth]{};
    alignas(64) int32_t isFront[kSoAWidth]; ///< see SurfaceSide
    alignas(64) float time[kSoAWidth];      ///< shutter fraction
    V2SoA lens;                             ///< in [0,1)²
    // Computed by SurfaceLattice::writeRequests:
    V3SoA p, n; ///< world-space position and normal, of any length
    V3SoA viewpoint;
    RayConeSoA cone; ///< as wide as a block at p
};

/// A lattice whose points are about `blockSize` pixels apart, as seen by the ray of the hit that uses them.
/// - Triangles larger than a block are divided along two of their edges into powers of two. Finer
///   divisions contain the points of coarser ones. Triangles with vertex normals share the points at
///   common vertices.
/// - Triangles smaller than a block share their vertices or, where a mesh has more vertices than
///   blocks, the points of mesh cells (MeshCells).
/// - Quadrics are divided in their (u, v).
///
/// Interpolation is continuous within a triangle that all hits divide alike, and across edges whose vertices
/// are shared.
class SurfaceLattice {
  public:
    /// The maximum distance between a hit and the points of its cell, in blocks, projected along the hit's
    /// ray. The two sides of a cell are at most two blocks long and may be parallel: 4. On a quadric each
    /// side bows by at most half a block, and opposite sides turn apart by at most 1. A mesh of small
    /// triangles that is stretched along one axis, by a non-uniform scale or a deformation, reaches farther
    /// along that axis, by the factor of the stretching.
    static constexpr float kReach = 6;
    /// Whether triangles smaller than a block share points, or are a cell each.
    enum class SmallTriangles { Shared, Apart };
    SurfaceLattice(const Scene& scene, float blockSize, SmallTriangles small);

    SurfaceCache makeSurfaceCache() const { return SurfaceCache(m_scene, m_meshCells); }
    /// Writes the cones at the centers of pixels, the input of `locate`.
    void computePixelCones(std::span<const PixelRef> pixels, std::vector<RayCone>& cones) const;
    /// Finds the cells of hits. The result for a hit does not depend on the other hits.
    void locate(LatticeHitSoA& hits, SurfaceCache& surfaces) const;
    /// Returns the cell of located hit number i.
    static LatticeCell cellOf(const LatticeHitSoA& hits, int i);
    /// Writes the points of a cell, cell.pointCount() of them, in the order of LatticeCell::computeWeights.
    /// Some points of a Grid may be missing, but not all: the weights of the others must then be scaled to
    /// sum to 1.
    void findPoints(const LatticeCell& cell, MeshPointCache& cache,
                    LatticePoint out[LatticeCell::kMaxPoints]) const;
    /// Writes the first `pointsPerCell` points of cells of divided triangles. `hits` are those of cells.hit.
    void findPoints(const HitSoA& hits, TriangleCellSoA& cells, int pointsPerCell) const;

    /// Returns whether all hits are on one triangle whose directions are fixed
    /// (LatticeSurface::hasFixedDirections). If so, sets all members of `patch` but the division.
    bool findCommonTriangle(const HitSoA& hits, int count, SurfaceCache& surfaces, LatticePatch& patch) const;
    /// LatticePatch::findDivision for samples on a common triangle.
    bool findCommonDivision(const VisibilitySoA& samples, int count, const RayConeSoA& cones,
                            SurfaceCache& surfaces, LatticePatch& patch) const;

    /// Returns the key of a shading point: a hash, not 0, of the point's position, its side and the time bin.
    static uint64_t keyOf(const LatticePoint& point, uint32_t bin) {
        const uint64_t key = mix64(appendFastHash<3>(point.keySum, bin));
        return key ? key : 1;
    }
    /// Writes hits, rays, times and cones of shading requests from number `first` of the chunk on.
    void writeRequests(ShadeSoA& shades, SurfaceCache& surfaces, RequestSoA& requests, int first) const;

  private:
    bool fetchSurfaces(LatticeHitSoA& hits, SurfaceCache& surfaces) const;
    void findMeshCells(LatticeHitSoA& hits, SurfaceCache& surfaces) const;
    void findSharedVertex(const HitSoA& hits, const TriangleCellSoA& cells, TriangleCellSoA::Points& points,
                          int c) const;
    void computeCones(ShadeSoA& shades) const;
    const TriangleMesh& meshOf(const SurfaceSide& side) const {
        return *m_scene.geometry({side.instance, side.geometry}).placed.shape.mesh;
    }
    const MeshCells& meshCellsOf(const SurfaceSide& side) const {
        return *strobe::meshCellsOf(m_meshCells, m_scene, side.instance, side.geometry);
    }

    const Scene& m_scene;
    const float m_blockSize; ///< pixels
    const bool m_sharesSmall;
    std::unordered_map<const TriangleMesh*, MeshCells> m_cellsOfMesh; ///< empty unless m_sharesSmall
    MeshCellsOfGroups m_meshCells;
};

} // namespace strobe
