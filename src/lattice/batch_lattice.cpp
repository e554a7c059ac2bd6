#include "lattice/batch_lattice.h"

#include <numeric>

namespace strobe {

/// The time bins of a chunk of hits, and the keys of their cells.
struct BatchLattice::CellKeySoA {
    alignas(64) uint32_t bin[kSoAWidth];
    alignas(64) uint64_t key[kSoAWidth];      ///< of the cell in a time bin group
    alignas(64) uint64_t keyInBin[kSoAWidth]; ///< of the cell in the time bin
};

/// Hits that represent all of a chunk: the first in each cell and time bin, and perhaps some more.
struct BatchLattice::DistinctHits {
    int count = 0;
    int32_t hits[kSoAWidth];
    uint32_t representative[kSoAWidth]; ///< for each hit, one of `hits` in the same cell and time bin

    DistinctHits(const uint64_t* keyInBin, int n);
};

/// The cells of a chunk of hits in the table.
struct BatchLattice::CellsOfHits {
    alignas(64) uint32_t cell[kSoAWidth];
    int requestingCount;
    int32_t requestingHits[kSoAWidth]; ///< the first in their cell and time bin since the table was cleared
};

BatchLattice::BatchLattice(const SurfaceLattice& lattice, const Settings& settings,
                           const RadianceCache& cache)
    : m_lattice(lattice), m_settings(settings), m_cache(cache), m_table(settings.timeBins),
      m_surfaces(lattice.makeSurfaceCache()), m_patches(lattice, cache, m_table, m_batch.shadingPoints) {}

void BatchLattice::begin(const VisibilityBatch& batch) {
    if (!m_settings.keepsValues || m_table.isFull()) {
        m_table.clear();
        m_patches.clear();
    }
    m_batch.shadingPoints.clear();
    m_batch.interpolation.resize(batch.samples.chunks());
    for (InterpolationSoA& chunk : m_batch.interpolation)
        std::fill_n(chunk.source, kSoAWidth, kNone);
    m_lattice.computePixelCones(batch.pixels, m_batch.pixelCones);
}

void BatchLattice::addSamples(const VisibilityBatch& batch, size_t chunk, const int32_t* indices, int count) {
    const VisibilitySoA& samples = batch.samples.chunk(chunk);
    LatticeHitSoA& hits = m_batch.hits;
    for (int k = 0; k < count; ++k) {
        const int i = indices[k];
        m_batch.sampleOfHit[hits.count] = uint32_t(chunk * kSoAWidth) + uint32_t(i);
        hits.push_back(samples.hit.at(i), samples.ray.d.at(i), samples.camera.time[i],
                       m_batch.pixelCones[samples.pixel[i]]);
        if (hits.count == kSoAWidth)
            locateHits();
    }
}

namespace {

/// Writes the cones of the pixels of n samples.
void copyPixelCones(const std::vector<RayCone>& pixelCones, const VisibilitySoA& samples, int n,
                    RayConeSoA& cones) {
    for (int i = 0; i < n;) {
        const uint32_t pixel = samples.pixel[i];
        const RayCone cone = pixelCones[pixel];
        const int first = i;
        i = samples.pixel[n - 1] == pixel ? n : i + 1;
        while (i < n && samples.pixel[i] == pixel)
            ++i;
        std::fill(cones.width + first, cones.width + i, cone.width);
        std::fill(cones.spread + first, cones.spread + i, cone.spread);
    }
}

} // namespace

void BatchLattice::addChunk(const VisibilityBatch& batch, size_t chunk) {
    locateHits();
    const VisibilitySoA& samples = batch.samples.chunk(chunk);
    const int n = batch.samples.chunkSize(chunk);
    LatticeHitSoA& hits = m_batch.hits;
    hits.count = n;
    hits.hit = samples.hit;
    hits.d = samples.ray.d;
    std::copy_n(samples.camera.time, kSoAWidth, hits.time);
    copyPixelCones(m_batch.pixelCones, samples, n, hits.cone);
    std::iota(m_batch.sampleOfHit, m_batch.sampleOfHit + n, uint32_t(chunk * kSoAWidth));
    locateHits();
}

bool BatchLattice::addPatch(const VisibilityBatch& batch, size_t chunk) {
    const VisibilitySoA& samples = batch.samples.chunk(chunk);
    const int n = batch.samples.chunkSize(chunk);
    LatticePatch patch;
    if (m_settings.nearest || m_settings.timeBins > m_table.groups().binCount() ||
        !m_lattice.findCommonTriangle(samples.hit, n, m_surfaces, patch))
        return false;
    locateHits(); // keeps the order of requests
    RayConeSoA cones;
    copyPixelCones(m_batch.pixelCones, samples, n, cones);
    PatchCells cells;
    InterpolationSoA& interpolation = m_batch.interpolation[chunk];
    if (!m_lattice.findCommonDivision(samples, n, cones, m_surfaces, patch) ||
        !cells.find(patch, samples.hit, n, interpolation.coords))
        return false;
    alignas(64) uint32_t bin[kSoAWidth];
    findTimeBins(samples.camera.time, n, m_settings.timeBins, bin);
    m_patches.add(patch, cells, bin, n, uint32_t(chunk * kSoAWidth), interpolation.source);
    return true;
}

void BatchLattice::finish() {
    locateHits();
    m_patches.finish();
}

namespace {

STROBE_TARGET_CLONES void computeKeysInBins(const LatticeHitSoA& hits, const uint32_t* bin, int binBits,
                                            uint64_t* key, uint64_t* keyInBin) {
    const int n = hits.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        key[i] = appendFastHash<4>(hits.key[i], bin[i] >> binBits);
        keyInBin[i] = appendFastHash<4>(hits.key[i], bin[i]);
    }
}

} // namespace

/// Neighboring samples are often in few cells, which are to be looked up once. A hit is compared with one
/// other hit only, the first with the same eight bits of the key.
BatchLattice::DistinctHits::DistinctHits(const uint64_t* keyInBin, int n) {
    uint8_t firstHit[256];
    for (int i = n; i-- > 0;)
        firstHit[uint8_t(keyInBin[i])] = uint8_t(i);
    for (int i = 0; i < n; ++i) {
        const uint32_t other = firstHit[uint8_t(keyInBin[i])];
        representative[i] = keyInBin[other] == keyInBin[i] ? other : uint32_t(i);
        hits[count] = i;
        count += representative[i] == uint32_t(i);
    }
}

/// Finds the cells of the batch's hits, requests the points of these cells, and removes the hits.
void BatchLattice::locateHits() {
    LatticeHitSoA& hits = m_batch.hits;
    if (hits.count == 0)
        return;
    m_lattice.locate(hits, m_surfaces);

    CellKeySoA keys;
    findTimeBins(hits.time, hits.count, m_settings.timeBins, keys.bin);
    computeKeysInBins(hits, keys.bin, m_table.groups().bits, keys.key, keys.keyInBin);
    const DistinctHits distinct(keys.keyInBin, hits.count);
    const CellsOfHits cells = findCells(keys, distinct);

    const size_t firstRequest = m_batch.shadingPoints.size();
    if (m_settings.nearest) {
        requestNearestPoints(keys, cells);
    } else {
        requestCellPoints(keys, cells);
        setSources(keys, cells);
    }
    m_batch.shadingPoints.computeKeys(firstRequest, m_table, m_cache);
    hits.count = 0;
}

BatchLattice::CellsOfHits BatchLattice::findCells(const CellKeySoA& keys, const DistinctHits& distinct) {
    for (int k = 0; k < distinct.count; ++k)
        m_table.prefetchCell(keys.key[distinct.hits[k]]);
    CellsOfHits cells;
    cells.requestingCount = 0;
    // New cells are added after all lookups, so that no lookup waits for them.
    int32_t newHits[kSoAWidth];
    int newCount = 0;
    const uint32_t firstNewCell = m_table.cellCount();
    for (int k = 0; k < distinct.count; ++k) {
        const int32_t i = distinct.hits[k];
        const uint32_t nextCell = firstNewCell + uint32_t(newCount);
        const auto [cell, wasRequested] =
            m_table.requestCell(keys.key[i], nextCell, m_table.groups().binInGroup(keys.bin[i]));
        cells.cell[i] = cell;
        cells.requestingHits[cells.requestingCount] = i;
        cells.requestingCount += !wasRequested;
        newHits[newCount] = i;
        newCount += cell == nextCell;
    }
    addCells(keys, newHits, newCount);
    for (int i = 0; i < m_batch.hits.count; ++i)
        cells.cell[i] = cells.cell[distinct.representative[i]];
    return cells;
}

/// Adds the cells of some of the batch's hits to the table.
void BatchLattice::addCells(const CellKeySoA& keys, const int32_t* newHits, int count) {
    if (count == 0)
        return;
    const LatticeHitSoA& hits = m_batch.hits;
    TriangleCellSoA triangles;
    uint32_t cellOfTriangle[kSoAWidth];
    for (int k = 0; k < count; ++k) {
        const int32_t i = newHits[k];
        const auto kind = LatticeCell::Kind(hits.kind[i]);
        const uint32_t cell = m_table.addCell(kind);
        if (kind == LatticeCell::Lower || kind == LatticeCell::Upper) {
            cellOfTriangle[triangles.count] = cell;
            triangles.push_back(hits, i);
        } else {
            m_table.setPoints(m_table.cell(cell), findPoints(i, m_table.groups().indexOf(keys.bin[i])));
        }
    }
    addTrianglePoints(keys, cellOfTriangle, triangles);
}

/// Adds the points of the cell of a hit to the table; the cell may be of any kind.
InterpolationTable::PointValues BatchLattice::findPoints(int hit, uint32_t group) {
    const LatticeCell cell = SurfaceLattice::cellOf(m_batch.hits, hit);
    LatticePoint points[LatticeCell::kMaxPoints];
    m_lattice.findPoints(cell, m_meshPoints, points);
    const uint32_t firstBin = m_table.groups().pack(group, 0);
    InterpolationTable::PointValues values{};
    for (int p = 0; p < cell.pointCount(); ++p) {
        if (points[p]) {
            const uint64_t key = SurfaceLattice::keyOf(points[p], firstBin);
            values[p] = m_table.groups().pack(m_table.findOrAddPoint(key, cell.side, points[p], group), 0);
        }
    }
    return values;
}

/// Adds the points of cells of divided triangles to the table, and sets them in `cells`.
void BatchLattice::addTrianglePoints(const CellKeySoA& keys, const uint32_t* cells,
                                     TriangleCellSoA& triangles) {
    const LatticeHitSoA& hits = m_batch.hits;
    const TimeBinGroups& groups = m_table.groups();
    m_lattice.findPoints(hits.hit, triangles, 3);
    alignas(64) uint64_t pointKeys[3][kSoAWidth];
    alignas(64) uint32_t firstBin[kSoAWidth];
    for (int c = 0; c < triangles.count; ++c)
        firstBin[c] = groups.pack(groups.indexOf(keys.bin[triangles.hit[c]]), 0);
    for (int k = 0; k < 3; ++k)
        triangles.computeKeys(k, firstBin, pointKeys[k]);
    for (int k = 0; k < 3; ++k)
        for (int c = 0; c < triangles.count; ++c)
            m_table.prefetchPoint(pointKeys[k][c]);
    for (int c = 0; c < triangles.count; ++c) {
        const int i = triangles.hit[c];
        const SurfaceSide side{hits.hit.instance[i], hits.hit.geometry[i], bool(hits.isFront[i])};
        InterpolationTable::Cell& cell = m_table.cell(cells[c]);
        for (int k = 0; k < 3; ++k) {
            const uint32_t point = m_table.findOrAddPoint(pointKeys[k][c], side, triangles.points[k].at(c),
                                                          groups.indexOf(firstBin[c]));
            cell.pointValues[k] = groups.pack(point, 0);
        }
    }
}

void BatchLattice::requestCellPoints(const CellKeySoA& keys, const CellsOfHits& cells) {
    m_batch.shadingPoints.reserve(size_t(LatticeCell::kMaxPoints) * size_t(cells.requestingCount));
    for (int k = 0; k < cells.requestingCount; ++k) {
        const int32_t i = cells.requestingHits[k];
        const InterpolationTable::Cell& cell = m_table.cell(cells.cell[i]);
        const uint32_t* values = m_table.pointValuesOf(cell);
        const uint32_t bin = m_table.groups().binInGroup(keys.bin[i]);
        for (int p = 0; p < LatticeCell::pointCountOf(cell.kind); ++p)
            m_batch.shadingPoints.request(m_table, m_table.groups().indexOf(values[p]), bin,
                                          m_batch.sampleOfHit[i]);
    }
}

void BatchLattice::requestNearestPoints(const CellKeySoA& keys, const CellsOfHits& cells) {
    const LatticeHitSoA& hits = m_batch.hits;
    m_batch.shadingPoints.reserve(size_t(hits.count));
    for (int i = 0; i < hits.count; ++i) {
        const uint32_t bin = m_table.groups().binInGroup(keys.bin[i]), sample = m_batch.sampleOfHit[i];
        const uint32_t value = m_table.nearestPointValue(cells.cell[i], hits.coords.at(i)) | bin;
        m_batch.interpolation[sample / kSoAWidth].source[sample % kSoAWidth] = value;
        m_batch.shadingPoints.request(m_table, m_table.groups().indexOf(value), bin, sample);
    }
}

/// Writes the coordinates and sources of the samples.
void BatchLattice::setSources(const CellKeySoA& keys, const CellsOfHits& cells) {
    const LatticeHitSoA& hits = m_batch.hits;
    const TimeBinGroups& groups = m_table.groups();
    const auto sourceOfHit = [&](int i) {
        return groups.pack(cells.cell[i], groups.binInGroup(keys.bin[i]));
    };
    const uint32_t first = m_batch.sampleOfHit[0], last = m_batch.sampleOfHit[hits.count - 1];
    if (first % kSoAWidth == 0 && last == first + uint32_t(hits.count - 1)) { // a whole chunk
        InterpolationSoA& chunk = m_batch.interpolation[first / kSoAWidth];
        chunk.coords = hits.coords;
        for (int i = 0; i < hits.count; ++i)
            chunk.source[i] = sourceOfHit(i);
        return;
    }
    for (int i = 0; i < hits.count; ++i) {
        const uint32_t sample = m_batch.sampleOfHit[i];
        InterpolationSoA& chunk = m_batch.interpolation[sample / kSoAWidth];
        chunk.coords.set(int(sample % kSoAWidth), hits.coords.at(i));
        chunk.source[sample % kSoAWidth] = sourceOfHit(i);
    }
}

void BatchLattice::interpolate(std::span<Rgb> values) const {
    for (size_t first = 0; first < values.size(); first += kSoAWidth) {
        const InterpolationSoA& chunk = m_batch.interpolation[first / kSoAWidth];
        const auto out = values.subspan(first, std::min<size_t>(kSoAWidth, values.size() - first));
        if (m_settings.nearest)
            m_table.interpolateNearest(chunk, out);
        else
            m_table.interpolate(chunk, out);
    }
}

uint64_t BatchLattice::mainKeyOf(size_t sample) const {
    const TimeBinGroups& groups = m_table.groups();
    const uint32_t source = sourceOf(sample);
    uint32_t value = source;
    if (!m_settings.nearest) {
        const V3f coords = m_batch.interpolation[sample / kSoAWidth].coords.at(int(sample % kSoAWidth));
        value = m_table.heaviestPointValue(groups.indexOf(source), coords);
    }
    const InterpolationTable::Point& point = m_table.point(groups.indexOf(value));
    return SurfaceLattice::keyOf(point.point, groups.pack(point.group, groups.binInGroup(source)));
}

} // namespace strobe
