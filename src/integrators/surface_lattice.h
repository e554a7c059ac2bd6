// Canonical shading points on every surface: which of them surround a hit, and with what weights.
#pragma once

#include "core/integrator.h"
#include "integrators/vertex_clusters.h"

#include <unordered_map>

namespace strobe {

/// A point of the lattice. Everything about it follows from its key alone, never from the sample that asks.
struct LatticePoint {
    Hit hit;       ///< its place: a triangle's barycentrics, or a quadric's numbers
    bool positive; ///< the side it is seen from: that of the surface's raw normal (winding, quadric), or the
                   ///< other
    uint64_t key;  ///< never 0
};

/// The points around a hit. Weights are positive and add up to 1.
struct Stencil {
    int count = 0;
    LatticePoint points[4];
    float weights[4];
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
    SurfaceLattice(const Scene& scene, float blockSize);

    Stencil stencil(const VisibilitySample& sample) const;
    /// The request to shade a point at shutter fraction `time`, as the camera sees it then.
    ShadingRequest request(const LatticePoint& point, float time) const;

  private:
    Stencil meshStencil(const PlacedShape& placed, const VisibilitySample& sample, const M44f* toWorld,
                        float block) const;
    Stencil clusterStencil(const TriangleMesh& mesh, const LatticePoint& at, float block) const;
    Stencil triangleStencil(const TriangleMesh& mesh, const LatticePoint& at, int divideU, int divideV) const;
    Stencil quadricStencil(const PlacedShape& placed, const VisibilitySample& sample, const M44f& toWorld,
                           float block) const;
    LatticePoint vertexPoint(const TriangleMesh& mesh, const LatticePoint& at, uint32_t vertex) const;
    LatticePoint cornerPoint(const TriangleMesh& mesh, const LatticePoint& at, int corner) const;
    LatticePoint innerPoint(const LatticePoint& at, float u, float v) const;
    V3f rawNormal(const LatticePoint& point, float time) const;
    /// The transform that placed geometry has at `time`; identity (null) for the world's baked meshes.
    const M44f* transformOf(const Hit& hit, const PlacedShape& placed, float time, M44f& storage) const;

    const Scene& m_scene;
    const float m_blockSize;
    const RayCone m_cone; ///< of any pixel: the footprint of points that no single pixel asked for
    std::unordered_map<const TriangleMesh*, VertexClusters> m_clusters;
};

} // namespace strobe
