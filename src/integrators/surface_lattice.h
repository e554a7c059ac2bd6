// Canonical shading points on every surface: which of them surround a hit, and with what weights.
#pragma once

#include "core/integrator.h"
#include "integrators/vertex_clusters.h"

#include <unordered_map>

namespace strobe {

/// A point of the lattice: a place on a primitive.
struct LatticePoint {
    uint64_t key;  ///< never 0; of face, place and time bin: all that the point's value depends on
    uint32_t prim; ///< of the face's geometry
    float u, v;    ///< a triangle's barycentrics, or a quadric's numbers
};

/// A surface, and the side it is seen from: that of its raw normal (winding, quadric), or the other.
struct LatticeFace {
    uint32_t instance, geometry;
    bool positive;
};

/// A mesh of the lattice: the part of a primitive between neighbouring points, and where in it a hit lies.
struct LatticeCell {
    uint64_t key; ///< of the mesh, never 0: hits with the same key have the same points
    LatticeFace face;
    uint32_t prim;
    enum Kind : uint8_t { Cluster, Lower, Upper, Rectangle } kind;
    int level;          ///< of a cluster
    float i, j, nu, nv; ///< else: the mesh's place in a division of u by nu and v by nv
    int count;          ///< of points
    float weights[4]{}; ///< of the points for this hit; not negative, they add up to 1
};

/// The lattice is as fine as `blockSize` pixels, seen from where the hit was seen:
/// - triangles larger than a block are divided along two of their edges into powers of two; points of a
/// coarser
///   division are points of the finer one too, and corners with vertex normals belong to the vertex, whoever
///   shares it;
/// - of triangles smaller than a block, the vertices; of much smaller ones, those that represent a cluster of
/// vertices;
/// - quadrics are divided in their (u, v).
/// Inside a triangle of one division, and across edges that share vertices, interpolation is continuous.
class SurfaceLattice {
  public:
    /// How many block sizes away, at most, the points of a cell are from a hit in it, as the hit's ray sees
    /// them.
    static constexpr float kReach = 4;
    /// What triangles smaller than a block do: share vertices and clusters of them, or be one cell each.
    enum class SmallTriangles { Clustered, Apart };
    SurfaceLattice(const Scene& scene, float blockSize, SmallTriangles small);

    /// `bin` is the part of the shutter: keys differ from bin to bin.
    LatticeCell locate(const VisibilitySample& sample, uint32_t bin) const;
    /// The points of a cell, `cell.count` of them, in the order of its weights.
    void points(const LatticeCell& cell, uint32_t bin, LatticePoint out[4]) const;
    /// The request to shade a point at shutter fraction `time`, as the camera sees it then through the point
    /// `lens` (in [0,1)²) of its lens.
    ShadingRequest request(const LatticeFace& face, const LatticePoint& point, float time,
                           const V2f& lens) const;

  private:
    void locateOnMesh(const PlacedShape& placed, const VisibilitySample& sample, const M44f* toWorld,
                      float block, uint32_t bin, LatticeCell& cell) const;
    void locateOnQuadric(const PlacedShape& placed, const VisibilitySample& sample, const M44f& toWorld,
                         float block, uint32_t bin, LatticeCell& cell) const;
    LatticePoint vertexPoint(const TriangleMesh& mesh, const LatticeFace& face, uint32_t bin,
                             uint32_t vertex) const;
    V3f rawNormal(const PlacedShape& placed, const Hit& hit, const M44f* toWorld, float time) const;
    /// The transform that placed geometry has at `time`; identity (null) for the world's baked meshes.
    const M44f* transformOf(uint32_t instance, const PlacedShape& placed, float time, M44f& storage) const;

    const Scene& m_scene;
    const float m_blockSize;
    const bool m_clustered;
    const RayCone m_cone; ///< the footprint of points that no single pixel asked for
    std::unordered_map<const TriangleMesh*, VertexClusters> m_clusters;
};

} // namespace strobe
