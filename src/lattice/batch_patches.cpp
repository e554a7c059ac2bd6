#include "lattice/batch_patches.h"

#include <bit>

namespace strobe {

namespace {

/// Returns a set bit for each of eight bytes that is not 0. The bytes are below 128.
uint32_t nonzeroBytes(uint64_t bytes) {
    constexpr uint64_t kOnes = 0x0101010101010101, kGather = 0x0102040810204080;
    const uint64_t ones = (bytes + 0x7f * kOnes) >> 7 & kOnes;
    return uint32_t(ones * kGather >> 56);
}

} // namespace

void BatchPatches::add(const LatticePatch& patch, const PatchCells& cells, const uint32_t* bin, int count,
                       uint32_t firstSample, uint32_t* source) {
    m_patchTable.select(patch);
    // For each cell, a byte for each time bin: 0, or 1 + the index of a sample. Any sample will do, so that
    // all are written without branches, which would be unpredictable.
    static_assert(std::endian::native == std::endian::little, "the first bin is the lowest byte");
    static_assert(TimeBinGroups::kMaxBins == sizeof(uint64_t) && kSoAWidth < 128);
    uint64_t sampleOfBin[PatchCells::kMaxIds];
    std::fill_n(sampleOfBin, cells.idCount(), 0);
    for (int i = 0; i < count; ++i)
        reinterpret_cast<uint8_t*>(sampleOfBin)[cells.idOf(i) * 8 + bin[i]] = uint8_t(i + 1);

    uint32_t sourceOfCell[PatchCells::kMaxIds];
    for (uint32_t word = 0; word < std::size(cells.occupied()); ++word) {
        for (uint64_t rest = cells.occupied()[word]; rest; rest &= rest - 1) {
            const uint32_t id = word * 64 + uint32_t(std::countr_zero(rest));
            const uint32_t cell = requestCell(patch, cells, id, sampleOfBin[id], firstSample);
            sourceOfCell[id] = m_table.groups().pack(cell, 0);
        }
    }
    for (int i = 0; i < count; ++i)
        source[i] = sourceOfCell[cells.idOf(i)] | bin[i];
}

/// Requests the points of a cell in the time bins whose byte of `sampleOfBin` is not 0. Returns the cell.
uint32_t BatchPatches::requestCell(const LatticePatch& patch, const PatchCells& cells, uint32_t id,
                                   uint64_t sampleOfBin, uint32_t firstSample) {
    const uint32_t column = cells.columnOf(id), row = cells.rowOf(id);
    const bool isUpper = PatchCells::isUpper(id);
    PatchTable::Cell& entry = m_patchTable.cell(column, row, isUpper);
    if (const uint64_t tag = m_patchTable.tagOf(column, row); entry.tag != tag)
        entry = {tag, addCell(patch, column, row, isUpper), 0};
    const uint32_t bins = nonzeroBytes(sampleOfBin);
    for (uint32_t rest = bins & ~entry.requestedBins; rest; rest &= rest - 1) {
        const uint32_t bin = uint32_t(std::countr_zero(rest));
        const uint32_t sample = firstSample + uint32_t(sampleOfBin >> 8 * bin & 0xff) - 1;
        m_pending.requests.push_back({entry.cell, bin, sample});
    }
    entry.requestedBins |= bins;
    return entry.cell;
}

uint32_t BatchPatches::addCell(const LatticePatch& patch, uint32_t column, uint32_t row, bool isUpper) {
    if (m_pending.nodes.count + 3 > kSoAWidth)
        finish();
    const uint32_t index = m_table.addCell(LatticeCell::Lower);
    InterpolationTable::Cell& cell = m_table.cell(index);
    cell.pointValues[0] = findOrAddNode(patch, column + isUpper, row + isUpper);
    cell.pointValues[1] = findOrAddNode(patch, column + 1, row);
    cell.pointValues[2] = findOrAddNode(patch, column, row + 1);
    m_pending.cells.push_back(index);
    return index;
}

/// Returns the lattice point of a node of the patch's grid, or kPending and the number of a pending node.
uint32_t BatchPatches::findOrAddNode(const LatticePatch& patch, uint32_t column, uint32_t row) {
    const uint32_t index = m_patchTable.nodeIndex(column, row);
    const uint64_t tag = m_patchTable.tagOf(column, row);
    PatchTable::Node& node = m_patchTable.node(index);
    if (node.tag == tag)
        return node.point;
    TriangleCellSoA& nodes = m_pending.nodes;
    const int k = nodes.count++;
    m_pending.nodeIndex[k] = index;
    m_pending.hits.instance[k] = patch.instance;
    m_pending.hits.geometry[k] = patch.geometry;
    m_pending.hits.prim[k] = patch.prim;
    nodes.points[0].prim[k] = patch.prim;
    nodes.hit[k] = k;
    nodes.isUpper[k] = 0;
    nodes.isFront[k] = patch.isFront;
    nodes.i[k] = float(column);
    nodes.j[k] = float(row);
    nodes.nu[k] = patch.nu;
    nodes.nv[k] = patch.nv;
    nodes.keySum[k] = patch.keySum;
    node = {tag, kPending | uint32_t(k)};
    return node.point;
}

/// Writes the lattice points of the pending nodes, here and in the patch table.
void BatchPatches::findNodePoints(uint32_t* points) {
    TriangleCellSoA& nodes = m_pending.nodes;
    m_lattice.findPoints(m_pending.hits, nodes, 1);
    constexpr uint32_t kFirstBin[kSoAWidth]{}; // of the only group
    alignas(64) uint64_t keys[kSoAWidth];
    nodes.computeKeys(0, kFirstBin, keys);
    for (int k = 0; k < nodes.count; ++k)
        m_table.prefetchPoint(keys[k]);
    for (int k = 0; k < nodes.count; ++k) {
        const SurfaceSide side{m_pending.hits.instance[k], m_pending.hits.geometry[k],
                               bool(nodes.isFront[k])};
        points[k] = m_table.findOrAddPoint(keys[k], side, nodes.points[0].at(k), 0);
        PatchTable::Node& node = m_patchTable.node(m_pending.nodeIndex[k]);
        if (node.point == (kPending | uint32_t(k))) // not replaced since
            node.point = points[k];
    }
}

void BatchPatches::finish() {
    uint32_t points[kSoAWidth];
    findNodePoints(points);
    for (const uint32_t cell : m_pending.cells)
        for (uint32_t& value : m_table.cell(cell).pointValues) {
            const uint32_t point = value & kPending ? points[value & ~kPending] : value;
            value = m_table.groups().pack(point, 0);
        }

    const size_t firstRequest = m_requests.size();
    m_requests.reserve(3 * m_pending.requests.size());
    for (const CellRequest& request : m_pending.requests)
        for (const uint32_t value : m_table.cell(request.cell).pointValues)
            m_requests.request(m_table, m_table.groups().indexOf(value), request.binInGroup, request.sample);
    m_requests.computeKeys(firstRequest, m_table, m_cache);
    m_pending.nodes.count = 0;
    m_pending.cells.clear();
    m_pending.requests.clear();
}

} // namespace strobe
