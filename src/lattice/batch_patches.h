// The part of BatchLattice for chunks of samples in one patch.
#pragma once

#include "lattice/shading_points.h"

namespace strobe {

/// Finds the cells of chunks whose samples lie in one patch, and requests the points of these cells. New
/// lattice points are found for several chunks together. For one thread; what the constructor gets must
/// outlive it.
class BatchPatches {
  public:
    /// `cache`: see ShadingPointList::computeKeys.
    BatchPatches(const SurfaceLattice& lattice, const RadianceCache& cache, InterpolationTable& table,
                 ShadingPointList& requests)
        : m_lattice(lattice), m_cache(cache), m_table(table), m_requests(requests) {}

    /// Forgets all cells; to be called when the table is cleared.
    void clear() { m_patchTable.clear(); }
    /// Adds the `count` samples of a chunk, of which `cells` are the cells and `bin` the time bins;
    /// `firstSample` is the index in the batch of the first. Writes `source`. Precondition: the table has one
    /// time bin group only.
    void add(const LatticePatch& patch, const PatchCells& cells, const uint32_t* bin, int count,
             uint32_t firstSample, uint32_t* source);
    /// Finds the points of all cells so far and requests them.
    void finish();

  private:
    uint32_t requestCell(const LatticePatch& patch, const PatchCells& cells, uint32_t id,
                         uint64_t sampleOfBin, uint32_t firstSample);
    uint32_t addCell(const LatticePatch& patch, uint32_t column, uint32_t row, bool isUpper);
    uint32_t findOrAddNode(const LatticePatch& patch, uint32_t column, uint32_t row);
    void findNodePoints(uint32_t* points);

    const SurfaceLattice& m_lattice;
    const RadianceCache& m_cache;
    InterpolationTable& m_table;
    ShadingPointList& m_requests;
    PatchTable m_patchTable;

    static constexpr uint32_t kPending =
        1u << 31; ///< marks the number of a pending node, instead of a point's index
    struct CellRequest {
        uint32_t cell, binInGroup, sample;
    };
    /// Added since the last `finish`.
    struct Pending {
        TriangleCellSoA nodes;         ///< cells, of each of which the first point is the node
        HitSoA hits;                   ///< of `nodes`: the triangles
        uint32_t nodeIndex[kSoAWidth]; ///< in the patch table
        std::vector<uint32_t> cells;   ///< their pointValues are points or pending nodes
        std::vector<CellRequest> requests;
    } m_pending;
};

} // namespace strobe
