#include "lattice/batch_lattice.h"

#include <bit>

namespace strobe {

namespace {

/// Of eight bytes: bits of those that are not 0, all below 128.
uint32_t bitsOfBytes(uint64_t bytes) {
    constexpr uint64_t kOnes = 0x0101010101010101, kGather = 0x0102040810204080;
    const uint64_t ones = (bytes + 0x7f * kOnes) >> 7 & kOnes;
    return uint32_t(ones * kGather >> 56);
}

} // namespace

/// They need no keys of cells.
bool BatchLattice::addPatch(const VisibilityBatch& batch, size_t b) {
    const VisibilitySoA& samples = batch.samples.chunk(b);
    const int n = batch.samples.chunkSize(b);
    if (m_settings.nearest || m_settings.timeBins > 1 << m_binBits ||
        !m_lattice.findTriangle(samples.hit, n, m_surfaces, m_patch))
        return false;
    locate();
    spreadCones(samples, n);
    Shares& shares = m_shares[b];
    if (!m_lattice.divide(samples, n, m_lanes, m_surfaces, m_patch) ||
        !m_patchCells.find(m_patch, samples.hit, n, shares.place))
        return false;
    m_patchTable.open(m_patch);
    findTimeBins(samples.camera.time, n, m_settings.timeBins, m_bin);
    // By cell and slot, a byte each: 0, or 1 and the number of one that asks. Written without a look at what
    // is there, as what is new is anyone's guess.
    static_assert(std::endian::native == std::endian::little, "the first slot is the lowest byte");
    uint64_t asking[PatchCells::kMax];
    uint32_t share[PatchCells::kMax];
    std::fill_n(asking, m_patchCells.count, 0);
    for (int i = 0; i < n; ++i)
        reinterpret_cast<uint8_t*>(asking)[m_patchCells.id[i] * 8 + m_bin[i]] = uint8_t(i + 1);
    for (uint32_t word = 0; word < std::size(m_patchCells.any); ++word)
        for (uint64_t rest = m_patchCells.any[word]; rest; rest &= rest - 1) {
            const uint32_t id = word * 64 + uint32_t(std::countr_zero(rest));
            const uint32_t number = askAtPlace(id, asking[id], uint32_t(b * kSoAWidth));
            share[id] = number << m_binBits;
        }
    for (int i = 0; i < n; ++i)
        shares.cell[i] = share[m_patchCells.id[i]] | m_bin[i];
    return true;
}

/// Asks for the points around a place of the patch. Returns the cell's number.
uint32_t BatchLattice::askAtPlace(uint32_t id, uint64_t asking, uint32_t firstSample) {
    const uint32_t column = m_patchCells.columnOf(id), row = m_patchCells.rowOf(id);
    const bool isUpper = PatchCells::isUpper(id);
    PatchTable::Cell& cell = m_patchTable.cell(column, row, isUpper);
    if (const uint64_t tag = m_patchTable.tagOf(column, row); cell.tag != tag)
        cell = {tag, learnCell(column, row, isUpper), 0};
    const uint32_t asked = bitsOfBytes(asking);
    for (uint32_t rest = asked & ~cell.asked; rest; rest &= rest - 1) {
        const uint32_t slot = uint32_t(std::countr_zero(rest));
        m_asking.push_back({cell.number, slot, firstSample + uint32_t(asking >> 8 * slot & 0xff) - 1});
    }
    cell.asked |= asked;
    return cell.number;
}

/// Appends a cell of the patch.
uint32_t BatchLattice::learnCell(uint32_t column, uint32_t row, uint32_t isUpper) {
    if (m_newNodes.count + 3 > kSoAWidth)
        addPatchPoints();
    const uint32_t number = uint32_t(m_cells.size());
    m_cells.push_back(
        {{learnNode(column + isUpper, row + isUpper), learnNode(column + 1, row), learnNode(column, row + 1)},
         LatticeCell::Lower});
    m_unfinished.push_back(number);
    return number;
}

/// The point of a patch's node, or the number of a new node.
uint32_t BatchLattice::learnNode(uint32_t column, uint32_t row) {
    const uint32_t place = m_patchTable.placeOf(column, row);
    const uint64_t tag = m_patchTable.tagOf(column, row);
    PatchTable::Node& node = m_patchTable.node(place);
    if (node.tag == tag)
        return node.point;
    TrianglePointSoA& nodes = m_newNodes;
    const int k = nodes.count++;
    m_newNodesAt[k] = place;
    m_newNodesHits.instance[k] = m_patch.instance, m_newNodesHits.geometry[k] = m_patch.geometry;
    m_newNodesHits.prim[k] = nodes.points[0].prim[k] = m_patch.prim;
    nodes.lane[k] = k, nodes.isUpper[k] = 0, nodes.positive[k] = m_patch.positive;
    nodes.i[k] = float(column), nodes.j[k] = float(row), nodes.nu[k] = m_patch.nu, nodes.nv[k] = m_patch.nv;
    nodes.keySum[k] = m_patch.keySum;
    node = {tag, kNew | uint32_t(k)};
    return node.point;
}

/// The points of new nodes; finishes what waits for them.
void BatchLattice::addPatchPoints() {
    TrianglePointSoA& nodes = m_newNodes;
    m_lattice.points(m_newNodesHits, nodes, 1);
    constexpr uint32_t kOnlyEra[kSoAWidth]{};
    nodes.mixKeys(0, kOnlyEra, m_key);
    for (int k = 0; k < nodes.count; ++k)
        m_pointTable.prefetch(m_key[k]);
    uint32_t point[kSoAWidth];
    for (int k = 0; k < nodes.count; ++k) {
        const LatticeFace face{m_newNodesHits.instance[k], m_newNodesHits.geometry[k],
                               bool(nodes.positive[k])};
        point[k] = pointAt(face, nodes.points[0].at(k), m_key[k], 0);
        PatchTable::Node& node = m_patchTable.node(m_newNodesAt[k]);
        if (node.point == (kNew | uint32_t(k))) // or another one took its place
            node.point = point[k];
    }
    for (const uint32_t number : m_unfinished)
        for (uint32_t& first : m_cells[number].few)
            first = (first & kNew ? point[first & ~kNew] : first) << m_binBits;

    const size_t known = m_blockCount;
    makeRoom(3 * m_asking.size());
    for (const Asking& asking : m_asking)
        for (const uint32_t first : m_cells[asking.cell].few)
            ask(first >> m_binBits, asking.slot, asking.sample);
    fileBlocks(known);
    nodes.count = 0, m_unfinished.clear(), m_asking.clear();
}

} // namespace strobe
