#include "lattice/batch_lattice.h"

#include <bit>
#include <numeric>

namespace strobe {

namespace {

/// The keys of hits' cells in their time bins and in the eras of these.
STROBE_TARGET_CLONES void mixBins(const LatticeSoA& l, const uint32_t* bin, int binBits, uint64_t* key,
                                  uint64_t* keyInBin) {
    const int n = l.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        key[i] = quickSum<4>(l.key[i], bin[i] >> binBits);
        keyInBin[i] = quickSum<4>(l.key[i], bin[i]);
    }
}

} // namespace

BatchLattice::BatchLattice(const SurfaceLattice& lattice, const Settings& settings,
                           const RadianceCache& prefetchFrom)
    : m_lattice(lattice), m_settings(settings), m_cache(prefetchFrom),
      m_binBits(std::min(int(std::bit_width(uint32_t(settings.timeBins - 1))), kMaxBinBits)),
      m_surfaces(lattice.surfaceCache()) {
    forget();
}

void BatchLattice::begin(const VisibilityBatch& batch) {
    // What a thing in motion covers is much the same for many batches. The tables of so many stay in the
    // second-level cache.
    constexpr size_t kMaxPoints = 3000, kMaxCells = 6000;
    m_blockCount = 0;
    if (!m_settings.remembers || m_points.size() > kMaxPoints || m_cells.size() > kMaxCells)
        forget();
    m_shares.resize(batch.samples.chunks());
    for (Shares& shares : m_shares)
        std::fill_n(shares.cell, kSoAWidth, kNone);
    m_lattice.findCones(batch.pixels, m_cones);
}

void BatchLattice::forget() {
    m_cells.clear(), m_more.clear();
    m_points.assign(1, Point{{}, {}, 0, ~0u}); // the one that is missing: nobody asks for it
    m_values.resize(std::max(m_values.size(), size_t(1) << m_binBits)); // the first are never set
    m_pointTable.clear();
    m_cellTable.clear();
    m_patchTable.clear();
}

void BatchLattice::addSome(const VisibilityBatch& batch, size_t b, const int32_t* lanes, int count) {
    const VisibilitySoA& samples = batch.samples.chunk(b);
    for (int k = 0; k < count; ++k) {
        const int i = lanes[k];
        m_sampleOf[m_lanes.count] = uint32_t(b * kSoAWidth) + uint32_t(i);
        m_lanes.add(samples.hit.at(i), samples.ray.d.at(i), samples.camera.time[i],
                    m_cones[samples.pixel[i]]);
        if (m_lanes.count == kSoAWidth)
            locate();
    }
}

void BatchLattice::addAll(const VisibilityBatch& batch, size_t b) {
    locate();
    const VisibilitySoA& samples = batch.samples.chunk(b);
    const int n = batch.samples.chunkSize(b);
    spreadCones(samples, n);
    m_lanes.count = n, m_lanes.hit = samples.hit, m_lanes.d = samples.ray.d;
    std::copy_n(samples.camera.time, kSoAWidth, m_lanes.time);
    std::iota(m_sampleOf, m_sampleOf + n, uint32_t(b * kSoAWidth));
    locate();
}

/// To each sample, that of its pixel.
void BatchLattice::spreadCones(const VisibilitySoA& samples, int n) {
    for (int i = 0; i < n;) {
        const uint32_t pixel = samples.pixel[i];
        const RayCone cone = m_cones[pixel];
        const int first = i;
        i = samples.pixel[n - 1] == pixel ? n : i + 1;
        while (i < n && samples.pixel[i] == pixel)
            ++i;
        std::fill(m_lanes.width + first, m_lanes.width + i, cone.width);
        std::fill(m_lanes.spread + first, m_lanes.spread + i, cone.spread);
    }
}

/// Finds the cells of the samples on their way, and asks for their points.
void BatchLattice::locate() {
    if (m_lanes.count == 0)
        return;
    m_lattice.locate(m_lanes, m_surfaces);
    findTimeBins(m_lanes.time, m_lanes.count, m_settings.timeBins, m_bin);
    mixBins(m_lanes, m_bin, m_binBits, m_key, m_keyInBin);
    const size_t known = m_blockCount;
    leaveOutRepeats();
    findCells();
    if (m_settings.nearest)
        shareNearest();
    else
        shareCells();
    fileBlocks(known);
    m_lanes.count = 0;
}

/// Neighbors are often in few cells. What is looked up for the first of each is left out for the others;
/// some more are looked up, where two cells' keys look alike.
void BatchLattice::leaveOutRepeats() {
    uint8_t first[256]; // by a part of the key
    for (int i = m_lanes.count; i-- > 0;)
        first[uint8_t(m_keyInBin[i])] = uint8_t(i);
    m_firstCount = 0;
    for (int i = 0; i < m_lanes.count; ++i) {
        const uint32_t other = first[uint8_t(m_keyInBin[i])];
        m_firstOf[i] = m_keyInBin[other] == m_keyInBin[i] ? other : uint32_t(i);
        m_firsts[m_firstCount] = i;
        m_firstCount += m_firstOf[i] == uint32_t(i);
    }
}

/// In two steps, so that no lookup waits for a cell to be made.
void BatchLattice::findCells() {
    for (int k = 0; k < m_firstCount; ++k)
        m_cellTable.prefetch(m_key[m_firsts[k]]);
    int32_t made[kSoAWidth];
    int count = 0;
    const uint32_t known = uint32_t(m_cells.size());
    m_askCount = 0;
    for (int k = 0; k < m_firstCount; ++k) {
        const int32_t i = m_firsts[k];
        const uint32_t next = known + uint32_t(count), bit = 1u << (m_bin[i] & slots());
        uint32_t& filed =
            m_cellTable.filed(m_key[i], next << kSlotsOfEra); // and bits of slots: those asked for
        m_cellOf[i] = filed >> kSlotsOfEra;
        m_asks[m_askCount] = i;
        m_askCount += !(filed & bit);
        filed |= bit;
        made[count] = i;
        count += m_cellOf[i] == next;
    }
    makeCells(made, count);
}

/// Appends the cells of some lanes.
void BatchLattice::makeCells(const int32_t* lanes, int count) {
    const size_t known = m_cells.size();
    m_newPoints.count = 0;
    for (int k = 0; k < count; ++k) {
        const int32_t i = lanes[k];
        const auto kind = LatticeCell::Kind(m_lanes.kind[i]);
        Cell& made = m_cells.emplace_back(Cell{{}, kind});
        if (kind == LatticeCell::Lower || kind == LatticeCell::Upper) {
            m_newPoints.push(m_lanes, i);
            continue;
        }
        const InterpolationTable::Firsts firsts = findPoints(i);
        if (made.hasMore())
            made.few[0] = uint32_t(m_more.size()), m_more.push_back(firsts);
        else
            std::copy_n(firsts.begin(), 3, made.few);
    }
    addTriangles(known);
}

/// The points of a lane's cell of any kind.
InterpolationTable::Firsts BatchLattice::findPoints(int lane) {
    const uint32_t era = m_bin[lane] >> m_binBits;
    const LatticeCell cell = SurfaceLattice::cellAt(m_lanes, lane);
    LatticePoint points[kPoints];
    m_lattice.points(cell, m_places, points);
    InterpolationTable::Firsts firsts{};
    for (int p = 0; p < cell.count(); ++p)
        if (points[p]) {
            const uint64_t key = SurfaceLattice::keyOf(points[p], era << m_binBits);
            firsts[p] = pointAt(cell.face, points[p], key, era) << m_binBits;
        }
    return firsts;
}

/// The points of new cells in divided triangles; the first new cell is number `known`.
void BatchLattice::addTriangles(size_t known) {
    m_lattice.points(m_lanes.hit, m_newPoints, 3);
    TrianglePointSoA& p = m_newPoints;
    alignas(64) uint64_t keys[3][kSoAWidth];
    alignas(64) uint32_t firstBin[kSoAWidth];
    for (int c = 0; c < p.count; ++c)
        firstBin[c] = m_bin[p.lane[c]] & ~slots();
    for (int k = 0; k < 3; ++k)
        p.mixKeys(k, firstBin, keys[k]);
    for (int k = 0; k < 3; ++k)
        for (int c = 0; c < p.count; ++c)
            m_pointTable.prefetch(keys[k][c]);
    for (int c = 0; c < p.count; ++c) {
        while (m_cells[known].kind != LatticeCell::Lower && m_cells[known].kind != LatticeCell::Upper)
            ++known;
        Cell& cell = m_cells[known++];
        const int32_t i = p.lane[c];
        const LatticeFace face{m_lanes.hit.instance[i], m_lanes.hit.geometry[i], bool(m_lanes.positive[i])};
        for (int k = 0; k < 3; ++k)
            cell.few[k] = pointAt(face, p.points[k].at(c), keys[k][c], firstBin[c] >> m_binBits) << m_binBits;
    }
}

uint32_t BatchLattice::pointAt(const LatticeFace& face, const LatticePoint& at, uint64_t key, uint32_t era) {
    const uint32_t next = uint32_t(m_points.size()), index = m_pointTable.insert(key, next);
    if (index == next) {
        m_points.push_back({face, at, era, 0});
        if (m_points.size() << m_binBits > m_values.size())
            m_values.resize(2 * m_points.size() << m_binBits);
    }
    return index;
}

void BatchLattice::shareCells() {
    askAround();
    const int n = m_lanes.count;
    const uint32_t from = m_sampleOf[0];
    const auto shareAt = [&](int i) { return cellAt(i) << m_binBits | (m_bin[i] & slots()); };
    if (from % kSoAWidth == 0 && m_sampleOf[n - 1] == from + uint32_t(n - 1)) {
        Shares& shares = m_shares[from / kSoAWidth];
        shares.place = m_lanes.place;
        for (int i = 0; i < n; ++i)
            shares.cell[i] = shareAt(i);
        return;
    }
    for (int i = 0; i < n; ++i) {
        Shares& shares = m_shares[m_sampleOf[i] / kSoAWidth];
        shares.place.set(int(m_sampleOf[i] % kSoAWidth), m_lanes.place.at(i));
        shares.cell[m_sampleOf[i] % kSoAWidth] = shareAt(i);
    }
}

void BatchLattice::shareNearest() {
    makeRoom(size_t(m_lanes.count));
    for (int i = 0; i < m_lanes.count; ++i) {
        const uint32_t slot = m_bin[i] & slots(), sample = m_sampleOf[i];
        const Cell& cell = m_cells[cellAt(i)];
        const uint32_t value = firstsOf(cell)[nearestOf(cell, m_lanes.place.at(i))] | slot;
        m_shares[sample / kSoAWidth].cell[sample % kSoAWidth] = value;
        ask(value >> m_binBits, slot, sample);
    }
}

void BatchLattice::makeRoom(size_t blocks) {
    if (m_blocks.size() < m_blockCount + blocks)
        m_blocks.resize(2 * (m_blockCount + blocks));
}

/// Asks for the points of the first in each cell and bin. In two steps, as most were asked for before, but
/// which is anyone's guess.
void BatchLattice::askAround() {
    makeRoom(size_t(kPoints) * size_t(m_askCount));
    for (int k = 0; k < m_askCount; ++k) {
        const int32_t i = m_asks[k];
        const Cell& cell = m_cells[m_cellOf[i]];
        const uint32_t* firsts = firstsOf(cell);
        for (int p = 0; p < LatticeCell::pointsOf(cell.kind); ++p)
            ask(firsts[p] >> m_binBits, m_bin[i] & slots(), m_sampleOf[i]);
    }
}

/// There is room. Without a branch on what was asked before, which is anyone's guess.
void BatchLattice::ask(uint32_t index, uint32_t slot, uint32_t sample) {
    Point& point = m_points[index];
    m_blocks[m_blockCount] = {0, index, slot, sample};
    m_blockCount += !(point.asked >> slot & 1);
    point.asked |= 1u << slot;
}

/// Files the blocks from number `first` on; they are looked up later, when the cache's memory has arrived.
void BatchLattice::fileBlocks(size_t first) {
    for (size_t i = first; i < m_blockCount; ++i) {
        Block& block = m_blocks[i];
        block.key = SurfaceLattice::keyOf(m_points[block.point].at, binOf(block));
        m_cache.prefetch(block.key);
    }
}

} // namespace strobe
