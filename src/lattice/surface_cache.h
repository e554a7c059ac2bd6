// What hits of one shape have in common.
#pragma once

#include "core/math/hash.h"
#include "core/scene/scene.h"
#include "lattice/mesh_cells.h"

namespace strobe {

/// Two edges of a triangle from its first vertex, or the derivatives of a quadric's place.
struct Edges {
    V3f a, b;
    void transform(const M44f& m) { a = transformVector(m, a), b = transformVector(m, b); }
};

/// Of each geometry of each group of a scene; null, or empty: none.
using CellsOfGroups = std::vector<std::vector<const MeshCells*>>;
inline const MeshCells* cellsOf(const CellsOfGroups& cells, const Scene& scene, uint32_t instance,
                                uint32_t geometry) {
    if (cells.empty())
        return nullptr;
    return cells[instance == kNone ? 0 : scene.instances()[instance].group][geometry];
}

/// A shape, or an instance's.
struct LatticeSurface {
    uint32_t instance = kNone, geometry = kNone;
    const PlacedShape* placed;
    const TriangleMesh* mesh;         ///< null: a quadric
    const Motion* motion;             ///< of its group; null: it rests
    uint64_t keySum;                  ///< surfaceSum
    const MeshCells* cells = nullptr; ///< of a mesh's small triangles; null if they do not share
    bool isFixed;                     ///< directions on it are the same at any time; then:
    M44f toWorld;
    M44f toObject;         ///< of a quadric
    float leastBlock2 = 0; ///< blocks of a smaller area gain nothing by the cells
    const uint32_t* indices;
    const V3f* positions;

    LatticeSurface() = default;
    LatticeSurface(const Scene& scene, uint32_t instance, uint32_t geometry, const CellsOfGroups& cells);
    bool isOf(const HitSoA& hit, int i) const {
        return hit.geometry[i] == geometry && hit.instance[i] == instance;
    }
    /// Of a mesh that is fixed, as its vertices are kept.
    Edges keptEdges(uint32_t prim) const {
        const uint32_t* index = indices + 3 * size_t(prim);
        const V3f p = positions[index[0]];
        return {positions[index[1]] - p, positions[index[2]] - p};
    }
    /// The same in the world; whose own meshes stand where they are.
    Edges fixedEdges(uint32_t prim) const {
        Edges edges = keptEdges(prim);
        if (motion)
            edges.transform(toWorld);
        return edges;
    }
    /// Of any mesh, in the world, at a shutter fraction.
    Edges edgesAt(uint32_t prim, float time) const;
    /// Where a vertex of a mesh is, in one of its triangles; there are cells.
    MeshPoint placeOf(uint32_t vertex) const {
        const uint32_t prim = cells->triangleOf(vertex), *index = &mesh->indices[3 * size_t(prim)];
        const bool isSecond = index[1] == vertex;
        return {prim, isSecond ? 1.f : 0.f, !isSecond && index[2] == vertex ? 1.f : 0.f};
    }
    /// Of a hit of a quadric: its edges, and whether the ray along d sees the side of its own normal.
    bool look(const Hit& hit, const V3f& d, float time, Edges& edges) const;
    /// The places in the world of hits `begin` to `end`, all of this shape, at shutter fractions, and normals
    /// there, of any length.
    void spots(const HitSoA& hits, const float* time, int begin, int end, V3SoA& p, V3SoA& n) const;

  private:
    void spotQuadric(const Hit& hit, float time, V3SoA& p, V3SoA& n, int i) const;
    void place(Edges& edges, float time) const;
    M44f toWorldAt(float time) const;
};

/// What the keys of the lattice have in common on a surface.
inline uint64_t surfaceSum(uint32_t instance, uint32_t geometry) {
    return quickSum<0>(kEmptyQuickSum, uint64_t(instance) << 32 | geometry);
}

/// Remembers the last few parts: neighbors often are on the same. For one thread; scene and cells outlive
/// it.
class SurfaceCache {
  public:
    SurfaceCache(const Scene& scene, const CellsOfGroups& cells) : m_scene(scene), m_cells(cells) {}
    const LatticeSurface& of(const HitSoA& hit, int i) {
        LatticeSurface& surface = m_surfaces[(5 * hit.instance[i] + hit.geometry[i]) % kCount];
        if (!surface.isOf(hit, i))
            surface = LatticeSurface(m_scene, hit.instance[i], hit.geometry[i], m_cells);
        return surface;
    }

  private:
    static constexpr uint32_t kCount = 16;
    const Scene& m_scene;
    const CellsOfGroups& m_cells;
    LatticeSurface m_surfaces[kCount];
};

} // namespace strobe
