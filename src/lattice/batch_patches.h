// The part of BatchLattice for chunks of samples in one patch.
#pragma once

#include "lattice/shading_points.h"

namespace strobe {

/// Finds the cells of chunks whose samples lie in one patch, and requests the points of these cells. New
/// lattice points are found for several chunks together. For one thread. The arguments of the constructor
/// must outlive the object.
class BatchPatches {
  public:
    /// `cache`: see ShadingPointList::computeKeys.
    BatchPatches(const SurfaceLattice& lattice, const RadianceCache& cache, InterpolationTable& table,
                 ShadingPointList& requests)
        : m_lattice(lattice), m_cache(cache), m_table(table), m_requests(requests) {}

    /// Forgets all cells; to be called when the table is cleared.
    void clear() { m_patchTable.clear(); }
    /// Adds the `count` samples of a chunk, given their cells and time bins. `firstSample` is the index of
    /// the first in the batch. Writes InterpolationSoA::source. Precondition: there is one time bin group.
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

    /// Marks the number of a pending node, where otherwise the index of a point is stored.
    static constexpr uint32_t kPending = 1u << 31;
    struct CellRequest {
        uint32_t cell, binInGroup, sample;
    };
    /// Added since the last `finish`.
    struct Pending {
        TriangleCellSoA nodes;         ///< cells whose first points are the nodes
        HitSoA hits;                   ///< of `nodes`; only the primitives are set
        uint32_t nodeIndex[kSoAWidth]; ///< in the patch table
        std::vector<uint32_t> cells;   ///< whose pointValues are points or pending nodes
        std::vector<CellRequest> requests;
    } m_pending;
};

} // namespace strobe
