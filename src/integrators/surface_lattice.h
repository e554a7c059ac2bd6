// Canonical shading points on every surface: which of them surround a hit, and with what weights.
#pragma once

#include "core/integrator.h"
#include "integrators/mesh_cells.h"

#include <unordered_map>

namespace strobe {

/// A point of the lattice: a place on a primitive.
struct LatticePoint {
    uint64_t key;  ///< of face, place and time bin: all that the point's value depends on; 0: no point
    uint32_t prim; ///< of the face's geometry
    float u, v;    ///< a triangle's barycentrics, or a quadric's numbers
};

/// A surface, and the side it is seen from: that of its raw normal (winding, quadric), or the other.
struct LatticeFace {
    uint32_t instance, geometry;
    bool positive;
};

/// A mesh of the lattice: what lies between neighbouring points, and where in it a hit lies.
struct LatticeCell {
    static constexpr int kPoints = 8; ///< at most
    uint64_t key;                     ///< of the mesh, never 0: hits with the same key have the same points
    LatticeFace face;
    uint32_t prim;
    enum Kind : uint8_t { Vertices, Grid, Lower, Upper, Rectangle } kind;
    MeshCell lowest;          ///< of the eight of a Grid
    float i, j, nu, nv;       ///< the mesh's place in a division of u by nu and v by nv
    int count;                ///< of points
    float weights[kPoints]{}; ///< of the points for this hit; not negative, they add up to 1
};

/// The lattice is as fine as `blockSize` pixels, seen from where the hit was seen:
/// - triangles larger than a block are divided along two of their edges into powers of two; points of a
/// coarser
///   division are points of the finer one too, and corners with vertex normals belong to the vertex, whoever
///   shares it;
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

    /// `cone`: of the sample's pixel. `bin` is the part of the shutter: keys differ from bin to bin.
    LatticeCell locate(const VisibilitySample& sample, const RayCone& cone, uint32_t bin) const;
    /// The cone of a pixel, for `locate`: that of its centre.
    RayCone coneOf(const PixelRef& pixel) const {
        return m_scene.camera().cone({float(pixel.x) + 0.5f, float(pixel.y) + 0.5f});
    }
    /// The points of a cell, `cell.count` of them, in the order of its weights. Some of eight may be missing:
    /// the weights of the others, scaled to add up to 1, are then the hit's.
    void points(const LatticeCell& cell, uint32_t bin, LatticePoint out[LatticeCell::kPoints]) const;
    /// The request to shade a point at shutter fraction `time`, as the camera sees it then through the point
    /// `lens` (in [0,1)²) of its lens.
    ShadingRequest request(const LatticeFace& face, const LatticePoint& point, float time,
                           const V2f& lens) const;

  private:
    void locateOnMesh(const PlacedShape& placed, const VisibilitySample& sample, const M44f* toWorld,
                      float block, uint32_t bin, LatticeCell& cell) const;
    void locateAmongSmall(const TriangleMesh& mesh, const Hit& hit, float cellArea, uint32_t bin,
                          LatticeCell& cell) const;
    void locateOnQuadric(const PlacedShape& placed, const VisibilitySample& sample, const M44f& toWorld,
                         float block, uint32_t bin, LatticeCell& cell) const;
    void gridPoints(const TriangleMesh& mesh, const LatticeCell& cell, uint32_t bin,
                    LatticePoint out[8]) const;
    LatticePoint vertexPoint(const TriangleMesh& mesh, const LatticeFace& face, uint32_t vertex,
                             uint32_t bin) const;
    V3f rawNormal(const PlacedShape& placed, const Hit& hit, const M44f* toWorld, float time) const;
    /// The transform that placed geometry has at `time`; identity (null) for the world's baked meshes.
    const M44f* transformOf(uint32_t instance, const PlacedShape& placed, float time, M44f& storage) const;

    const Scene& m_scene;
    const float m_blockSize;
    const bool m_sharesSmall;
    const RayCone m_cone; ///< the footprint of points that no single pixel asked for
    std::unordered_map<const TriangleMesh*, MeshCells> m_cells;
};

} // namespace strobe
