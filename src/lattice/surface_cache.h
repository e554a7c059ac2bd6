// Per-geometry data for the lattice, cached per thread.
#pragma once

#include "core/math/hash.h"
#include "core/scene/scene.h"
#include "lattice/mesh_cells.h"

namespace strobe {

/// The edges of a triangle from its first vertex, or the derivatives of a quadric's position by u and v.
struct Edges {
    V3f a, b;
    void transform(const M44f& m) {
        a = transformVector(m, a);
        b = transformVector(m, b);
    }
};

/// The mesh cells of a scene by group and geometry. Null: a quadric. Empty: triangles do not share points.
using MeshCellsOfGroups = std::vector<std::vector<const MeshCells*>>;
inline const MeshCells* meshCellsOf(const MeshCellsOfGroups& cells, const Scene& scene, uint32_t instance,
                                    uint32_t geometry) {
    if (cells.empty())
        return nullptr;
    return cells[instance == kNone ? 0 : scene.instances()[instance].group][geometry];
}

/// A geometry of the world or of an instance.
struct LatticeSurface {
    uint32_t instance = kNone, geometry = kNone;
    const PlacedShape* placed;
    const TriangleMesh* mesh;         ///< null: a quadric
    const Motion* motion;             ///< group to world; null: identity
    uint64_t keySum;                  ///< surfaceKeySum
    const MeshCells* cells = nullptr; ///< of the mesh; null: its triangles do not share points
    // Directions on the surface are the same at all times: it is static or only translates. Only then the
    // members below are set.
    bool hasFixedDirections;
    M44f toWorld;            ///< at shutter fraction 0
    M44f toObject;           ///< of a quadric: the inverse
    float minBlockArea = 0;  ///< mesh cells of smaller blocks would be more than the vertices; scene units²
    const uint32_t* indices; ///< of the mesh
    const V3f* positions;    ///< of the mesh

    LatticeSurface() = default;
    LatticeSurface(const Scene& scene, uint32_t instance, uint32_t geometry,
                   const MeshCellsOfGroups& cellsOfGroups);
    bool isHitBy(const HitSoA& hits, int i) const {
        return hits.geometry[i] == geometry && hits.instance[i] == instance;
    }
    /// Returns the edges of a triangle in the space of the mesh. Precondition: hasFixedDirections.
    Edges meshEdges(uint32_t prim) const {
        const uint32_t* index = indices + 3 * size_t(prim);
        const V3f p = positions[index[0]];
        return {positions[index[1]] - p, positions[index[2]] - p};
    }
    /// Returns the edges of a triangle in world space. Meshes without motion are stored in world space.
    /// Precondition: hasFixedDirections.
    Edges worldEdges(uint32_t prim) const {
        Edges edges = meshEdges(prim);
        if (motion)
            edges.transform(toWorld);
        return edges;
    }
    /// Returns the edges of a triangle of any mesh in world space at a shutter fraction.
    Edges worldEdgesAt(uint32_t prim, float time) const;
    /// Returns the position of a vertex in MeshCells::triangleOf. Precondition: there are cells.
    MeshPoint meshPointOf(uint32_t vertex) const {
        const uint32_t prim = cells->triangleOf(vertex);
        const uint32_t* index = &mesh->indices[3 * size_t(prim)];
        const bool isSecond = index[1] == vertex;
        return {prim, isSecond ? 1.f : 0.f, !isSecond && index[2] == vertex ? 1.f : 0.f};
    }
    /// Writes the derivatives of a quadric's position at a hit, in world space. Returns whether a ray along d
    /// sees the front (see SurfaceSide).
    bool computeQuadricEdges(const Hit& hit, const V3f& d, float time, Edges& edges) const;
    /// Writes the world-space positions p, and normals n of any length, of hits begin … end-1 at shutter
    /// fractions `time`. All hits are on this surface.
    void computePoints(const HitSoA& hits, const float* time, int begin, int end, V3SoA& p, V3SoA& n) const;

  private:
    void computeQuadricPoint(const Hit& hit, float time, V3SoA& p, V3SoA& n, int i) const;
    M44f toWorldAt(float time) const;
};

/// Returns the part of lattice keys that depends on the geometry: see appendFastHash.
inline uint64_t surfaceKeySum(uint32_t instance, uint32_t geometry) {
    return appendFastHash<0>(kEmptyFastHash, uint64_t(instance) << 32 | geometry);
}

/// A cache of the last few surfaces, for one thread: neighboring hits are often on the same. The scene and
/// the cells must outlive it.
class SurfaceCache {
  public:
    SurfaceCache(const Scene& scene, const MeshCellsOfGroups& cells) : m_scene(scene), m_cells(cells) {}
    /// Returns the surface of hit i, valid until the next call.
    const LatticeSurface& surfaceOf(const HitSoA& hits, int i) {
        LatticeSurface& surface = m_surfaces[(5 * hits.instance[i] + hits.geometry[i]) % kCount];
        if (!surface.isHitBy(hits, i))
            surface = LatticeSurface(m_scene, hits.instance[i], hits.geometry[i], m_cells);
        return surface;
    }

  private:
    static constexpr uint32_t kCount = 16;
    const Scene& m_scene;
    const MeshCellsOfGroups& m_cells;
    LatticeSurface m_surfaces[kCount];
};

} // namespace strobe
