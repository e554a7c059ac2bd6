// The cells of hits that are all on one triangle, found by counting instead of by keys.
#pragma once

#include "integrators/lattice_lanes.h"
#include "integrators/surface_parts.h"

namespace strobe {

/// Up to kLanes hits of one triangle that is divided alike for all of them. Their cells are a few of a
/// regular mesh, of columns of u and rows of v, whose nodes are the points.
struct LatticePatch {
    /// Finds the cells of the samples' hits, all of one triangle whose keys begin with `sum`, and their
    /// places in these (LatticeLanes::place). False: the division differs among them, or some would be
    /// Vertices, or they are too far apart.
    bool find(const VisibilityLanes& samples, int samplesCount, const Edges& edges, uint64_t sum,
              const LatticeLanes& cones, float blockSize, bool sharesSmall, V3Lanes& place);
    /// Then lists those cells and nodes that samples are in, each in one of eight slots.
    void list(const uint32_t* slot);

    int count; ///< of hits
    uint32_t prim;
    uint64_t keySum;
    alignas(64) int32_t column[kLanes], row[kLanes], isUpper[kLanes];
    alignas(64) float nu[kLanes], nv[kLanes];
    alignas(64) int32_t negative[kLanes]; ///< not LatticeFace::positive
    alignas(64) int32_t cell[kLanes];     ///< which: two for each place of the mesh
    int firstColumn, firstRow, columns, rows;

    struct Cell {
        int32_t cell;
        uint8_t node[3]; ///< among those listed, in the order of weights
    };
    int cells; ///< listed
    Cell listed[kLanes];
    TrianglePointLanes nodes; ///< listed: the first point of each
    uint8_t slots[kLanes];    ///< of nodes: bits of those that ask for it
    uint8_t hit[kLanes];      ///< one of the hits that ask for it

  private:
    static constexpr int kMostNodes = kLanes;
    void fillNodes();
};

} // namespace strobe
