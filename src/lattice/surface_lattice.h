// Canonical shading points on every surface: which of them surround a hit, and with what weights.
#pragma once

#include "core/math/hash.h"
#include "core/render/integrator.h"
#include "lattice/lattice_patch.h"
#include "lattice/surface_cache.h"

#include <unordered_map>

namespace strobe {

/// Points of the lattice that are to be shaded, at shutter fractions `time`, as the camera sees them then
/// through points `lens` (in [0,1)²) of its lens.
struct ShadedPointSoA {
    int count = 0;
    HitSoA hit;                              ///< but for t
    bool isVertex[kSoAWidth]{};              ///< whose number `prim` is, until it is placed in a triangle
    alignas(64) int32_t positive[kSoAWidth]; ///< see LatticeFace
    alignas(64) float time[kSoAWidth];
    V2SoA lens;
    // Fetched for these:
    V3SoA p, n; ///< in the world; the normal of any length
    V3SoA viewpoint;
    alignas(64) float width[kSoAWidth], spread[kSoAWidth]; ///< of the cones of blocks there
};

/// The lattice is as fine as `blockSize` pixels, seen from where the hit was seen:
/// - triangles larger than a block are divided along two of their edges into powers of two; points of a
///   coarser division are points of the finer one too, and corners with vertex normals belong to the vertex,
///   whoever shares it;
/// - triangles smaller than a block share their vertices or, where these are more than blocks, the places
///   that stand for the cells of a grid (MeshCells);
/// - quadrics are divided in their (u, v).
/// Inside a triangle of one division, and across edges that share vertices, interpolation is continuous.
class SurfaceLattice {
  public:
    /// How many block sizes away, at most, the points of a cell are from a hit in it, as the hit's ray sees
    /// them. A cell's sides are at most two long and may lie in one direction: that is four, and where a
    /// quadric bends, half for each side's bow and up to one for their turning apart. A mesh of small
    /// triangles that is stretched (by unequal scales, or deforming) more one way than another reaches as
    /// much farther that way.
    static constexpr float kReach = 6;
    /// What triangles smaller than a block do: share points, or be one cell each.
    enum class SmallTriangles { Shared, Apart };
    SurfaceLattice(const Scene& scene, float blockSize, SmallTriangles small);

    /// Finds the places of hits. Each is a function of its own numbers alone.
    void locate(LatticeSoA& lanes, SurfaceCache& surfaces) const;
    /// What a thread brings along.
    SurfaceCache surfaceCache() const { return SurfaceCache(m_scene, m_cellsOf); }
    /// The cell of a hit that was located.
    static LatticeCell cellAt(const LatticeSoA& lanes, int i);
    /// The cones of pixels, for `locate`: those of their centers.
    void findCones(std::span<const PixelRef> pixels, std::vector<RayCone>& cones) const;
    /// The points of a cell, `cell.count()` of them, in the order of its weights. Some of eight may be
    /// missing (not all): the weights of the others, scaled to add up to 1, are then a hit's.
    void points(const LatticeCell& cell, MeshPointCache& known, LatticePoint out[LatticeCell::kPoints]) const;
    /// The same for those of some hits that are in divided triangles (Lower, Upper): the first `each` points.
    void points(const HitSoA& hits, TrianglePointSoA& out, int each) const;
    /// Whether all hits are of one triangle of a mesh that is fixed, and which.
    bool findTriangle(const HitSoA& hits, int count, SurfaceCache& surfaces, LatticePatch& patch) const;
    /// Then, whether the samples' hits are a patch; `cones` has those of their pixels.
    bool divide(const VisibilitySoA& samples, int count, const LatticeSoA& cones, SurfaceCache& surfaces,
                LatticePatch& patch) const;
    /// Of face, place and part of the shutter: all that a shaded point's value depends on. Never 0.
    static uint64_t keyOf(const LatticePoint& point, uint32_t bin) {
        const uint64_t key = mix64(quickSum<3>(point.keySum, bin));
        return key ? key : 1;
    }
    /// The requests to shade points, from lane `at` on: hits, rays, times and cones.
    void request(ShadedPointSoA& points, SurfaceCache& surfaces, RequestSoA& out, int at) const;

  private:
    bool fetch(LatticeSoA& lanes, SurfaceCache& surfaces) const;
    void findCones(ShadedPointSoA& points) const;
    void findGrids(LatticeSoA& lanes, SurfaceCache& surfaces) const;
    void findVertex(const HitSoA& hits, const TrianglePointSoA& cells, TrianglePointSoA::Points& points,
                    int c) const;
    const TriangleMesh& meshOf(const LatticeFace& face) const {
        return *m_scene.geometry({face.instance, face.geometry}).placed.shape.mesh;
    }
    void gridPoints(const MeshCells& cells, const LatticeCell& cell, MeshPointCache& known,
                    LatticePoint out[8]) const;
    const MeshCells& cellsOf(const LatticeFace& face) const {
        return *strobe::cellsOf(m_cellsOf, m_scene, face.instance, face.geometry);
    }

    const Scene& m_scene;
    const float m_blockSize;
    const bool m_sharesSmall;
    std::unordered_map<const TriangleMesh*, MeshCells> m_cells; ///< empty unless small triangles share
    CellsOfGroups m_cellsOf;
};

} // namespace strobe
