#include "integrators/batch_lattice.h"

#include <bit>
#include <numeric>

namespace strobe {

namespace {

/// The time bins of hits, and the keys of their cells in the eras of these.
STROBE_LANES void binLanes(const LatticeLanes& l, int bins, int binBits, uint32_t* bin, uint64_t* key) {
    const int n = l.count;
    STROBE_INDEPENDENT
    for (int i = 0; i < n; ++i) {
        bin[i] = uint32_t(std::min(int(l.time[i] * float(bins)), bins - 1));
        key[i] = quickSum<4>(l.key[i], bin[i] >> binBits);
    }
}

} // namespace

BatchLattice::BatchLattice(const SurfaceLattice& lattice, const Settings& settings,
                           const BlockCache& prefetchFrom)
    : m_lattice(lattice), m_settings(settings), m_cache(prefetchFrom),
      m_binBits(std::min(int(std::bit_width(uint32_t(settings.timeBins - 1))), kMostBinBits)) {}

void BatchLattice::begin(size_t samples) {
    m_blocks.clear();
    m_cells.clear();
    m_points.assign(1, Point{}); // the one that is missing
    m_values.assign(size_t(1) << m_binBits, Value{});
    m_shares.assign(samples, {V3f(0), kNone});
    if (m_settings.nearest)
        m_nearest.resize(samples);
    m_pointTable.clear();
    m_cellTable.clear();
}

void BatchLattice::add(const VisibilitySample& sample, const PixelRef& pixel, uint32_t index) {
    m_sampleOf[m_lanes.count] = index;
    m_lanes.add(sample, m_lattice.coneOf(pixel));
    if (m_lanes.count == kLanes)
        locate();
}

void BatchLattice::addAll(const VisibilityBatch& batch, size_t b) {
    locate();
    const VisibilityLanes& samples = batch.samples.block(b);
    const int n = batch.samples.inBlock(b);
    m_lanes.count = n, m_lanes.hit = samples.hit, m_lanes.d = samples.ray.d;
    std::copy_n(samples.camera.time, kLanes, m_lanes.time);
    for (int i = 0; i < n;) {
        const uint32_t pixel = samples.pixel[i];
        const RayCone cone = m_lattice.coneOf(batch.pixels[pixel]);
        for (; i < n && samples.pixel[i] == pixel; ++i)
            m_lanes.width[i] = cone.width, m_lanes.spread[i] = cone.spread;
    }
    std::iota(m_sampleOf, m_sampleOf + n, uint32_t(b * kLanes));
    locate();
}

/// Finds the cells of the samples on their way, and asks for their points.
void BatchLattice::locate() {
    if (m_lanes.count == 0)
        return;
    m_lattice.locate(m_lanes);
    binLanes(m_lanes, m_settings.timeBins, m_binBits, m_bin, m_key);
    const uint32_t slots = (1u << m_binBits) - 1;
    for (int i = 0; i < m_lanes.count; ++i) {
        const uint32_t slot = m_bin[i] & slots, next = uint32_t(m_cells.size());
        const uint32_t c = m_cellTable.insert(m_key[i], next);
        if (c == next)
            m_cells.push_back(makeCell(SurfaceLattice::cellAt(m_lanes, i), m_bin[i] >> m_binBits));
        Cell& cell = m_cells[c];
        const V3f place = m_lanes.place.at(i);
        m_shares[m_sampleOf[i]] = {place, c << m_binBits | slot};
        if (m_settings.nearest) {
            const uint32_t point = cell.point[nearestOf(cell, place)];
            m_nearest[m_sampleOf[i]] = point << m_binBits | slot;
            ask(point, slot, m_sampleOf[i]);
        } else if (!(cell.asked >> slot & 1)) {
            cell.asked |= uint8_t(1u << slot);
            for (int k = 0; k < LatticeCell::pointsOf(cell.kind); ++k)
                if (cell.point[k])
                    ask(cell.point[k], slot, m_sampleOf[i]);
        }
    }
    m_lanes.count = 0;
}

BatchLattice::Cell BatchLattice::makeCell(const LatticeCell& cell, uint32_t era) {
    LatticePoint points[kPoints];
    m_lattice.points(cell, points);
    Cell made{cell.kind, 0, {}};
    for (int k = 0; k < cell.count(); ++k)
        if (points[k])
            made.point[k] = pointAt(cell.face, points[k], era);
    return made;
}

uint32_t BatchLattice::pointAt(const LatticeFace& face, const LatticePoint& at, uint32_t era) {
    const uint64_t key = SurfaceLattice::keyOf(at, era << m_binBits);
    const uint32_t next = uint32_t(m_points.size()), index = m_pointTable.insert(key, next);
    if (index == next) {
        m_points.push_back({face, at, era, 0});
        m_values.resize(m_points.size() << m_binBits);
    }
    return index;
}

/// Files the block of a point; it is looked up later, when the cache's memory has arrived.
void BatchLattice::ask(uint32_t index, uint32_t slot, uint32_t sample) {
    Point& point = m_points[index];
    if (point.asked >> slot & 1)
        return;
    point.asked |= 1u << slot;
    const uint64_t key = SurfaceLattice::keyOf(point.at, binOf(point, slot));
    m_cache.prefetch(key);
    m_blocks.push_back({key, index, slot, sample});
}

uint64_t BatchLattice::mainKeyOf(size_t sample) const {
    const Share& share = m_shares[sample];
    const Cell& cell = m_cells[share.cell >> m_binBits];
    const Point& point = m_points[m_settings.nearest ? m_nearest[sample] >> m_binBits
                                                     : cell.point[heaviestOf(cell, share.place)]];
    return SurfaceLattice::keyOf(point.at, binOf(point, slotOf(share)));
}

/// Of a cell's points, that with the greatest weight.
int BatchLattice::heaviestOf(const Cell& cell, const V3f& place) {
    float weights[kPoints];
    LatticeCell::weigh(cell.kind, place, weights);
    int best = 0;
    float most = -1;
    for (int k = 0; k < LatticeCell::pointsOf(cell.kind); ++k)
        if (cell.point[k] && weights[k] > most)
            best = k, most = weights[k];
    return best;
}

/// Of a cell's points, the nearest; if it is missing, of the others, which are a grid cell's, the one fewest
/// edges away.
int BatchLattice::nearestOf(const Cell& cell, const V3f& place) {
    const int wanted = LatticeCell::nearest(cell.kind, place);
    if (cell.point[wanted])
        return wanted;
    int best = wanted, fewest = kPoints;
    for (int k = 0; k < LatticeCell::pointsOf(cell.kind); ++k)
        if (const int edges = std::popcount(unsigned(k ^ wanted)); cell.point[k] && edges < fewest)
            best = k, fewest = edges;
    return best;
}

} // namespace strobe
