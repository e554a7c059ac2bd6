#include "lattice/lattice_patch.h"

#include <climits>

namespace strobe {

namespace {

/// The range of floats that are not negative, as their bits: these are in the same order.
struct BitRange {
    int32_t minBits = INT_MAX, maxBits = 0;
    float min() const { return std::bit_cast<float>(minBits); }
    float max() const { return std::bit_cast<float>(maxBits); }
};

/// The ranges of the inputs of a division: see divideTriangle.
struct DivisionRanges {
    BitRange a2, b2, area2, blockSize;
    int32_t anyFront = 0, anyBack = 0;
};

/// Computes as divideTriangle, to the same bits.
STROBE_TARGET_CLONES void findRanges(const VisibilitySoA& samples, int n, const Edges& edges,
                                     const RayConeSoA& cones, float blockSizeInPixels, DivisionRanges& out) {
    const V3f a = edges.a, b = edges.b, normal = cross(a, b);
    BitRange a2Range, b2Range, area2Range, blockRange;
    int32_t anyFront = 0, anyBack = 0;
    const auto bits = [](float x) { return std::bit_cast<int32_t>(x); };
    for (int k = 0; k < n; ++k) {
        const V3f d = samples.ray.d.at(k);
        const float facing = dot(normal, d);
        const int32_t a2 = bits(projectedLength2(a, d)), b2 = bits(projectedLength2(b, d));
        const int32_t area2 = bits(sqr(facing));
        const int32_t block = bits(blockSizeInPixels * (cones.width[k] + samples.hit.t[k] * cones.spread[k]));
        a2Range = {std::min(a2Range.minBits, a2), std::max(a2Range.maxBits, a2)};
        b2Range = {std::min(b2Range.minBits, b2), std::max(b2Range.maxBits, b2)};
        area2Range = {std::min(area2Range.minBits, area2), std::max(area2Range.maxBits, area2)};
        blockRange = {std::min(blockRange.minBits, block), std::max(blockRange.maxBits, block)};
        anyFront |= facing < 0;
        anyBack |= !(facing < 0);
    }
    out = {a2Range, b2Range, area2Range, blockRange, anyFront, anyBack};
}

} // namespace

bool LatticePatch::findDivision(const VisibilitySoA& samples, int count, const Edges& edges,
                                const RayConeSoA& cones, float blockSizeInPixels, bool sharesSmall) {
    DivisionRanges r;
    findRanges(samples, count, edges, cones, blockSizeInPixels, r);
    if (r.anyFront && r.anyBack)
        return false;
    // Rounded sums and products are monotonic in their operands, and so is the division: if it is the same at
    // both ends of the ranges, it is the same for all hits.
    const float minBlock2 = sqr(r.blockSize.min()), maxBlock2 = sqr(r.blockSize.max());
    if (sharesSmall && !(std::max(r.a2.min(), r.b2.min()) >= kUndividedLength2 * maxBlock2))
        return false;
    const float minSine2 = clampedSine2(r.a2.max(), r.b2.max(), r.area2.min());
    const float maxSine2 = clampedSine2(r.a2.min(), r.b2.min(), r.area2.max());
    const auto findCommonCount = [&](const BitRange& edge2, float& n) {
        const int minDivision = divisionFor(sqr(edge2.min() * (1 / maxBlock2)) * minSine2);
        const int maxDivision = divisionFor(sqr(edge2.max() * (1 / minBlock2)) * maxSine2);
        n = segmentCount(minDivision);
        return minDivision == maxDivision;
    };
    isFront = r.anyFront;
    return findCommonCount(r.a2, nu) && findCommonCount(r.b2, nv);
}

namespace {

struct GridRange {
    uint32_t firstColumn = UINT32_MAX, lastColumn = 0, firstRow = UINT32_MAX, lastRow = 0;
};

struct GridPositionSoA {
    alignas(64) uint32_t column[kSoAWidth], row[kSoAWidth], isUpper[kSoAWidth];
};

/// Computes as divideTriangleSoA, to the same bits.
STROBE_TARGET_CLONES GridRange findGridPositions(const LatticePatch& patch, const HitSoA& hits, int n,
                                                 GridPositionSoA& positions, V3SoA& coords) {
    const float nu = patch.nu, nv = patch.nv;
    GridRange r;
    STROBE_IVDEP
    for (int k = 0; k < n; ++k) {
        const GridPosition p = gridPosition(hits.u[k], hits.v[k], nu, nv);
        const bool isUpper = isInUpperTriangle(p);
        const uint32_t column = uint32_t(int(p.i)), row = uint32_t(int(p.j));
        const float x = isUpper ? 1 - p.y : p.x, y = isUpper ? 1 - p.x : p.y;
        coords.x[k] = x;
        coords.y[k] = y;
        coords.z[k] = firstWeight(x, y);
        positions.column[k] = column;
        positions.row[k] = row;
        positions.isUpper[k] = isUpper;
        r.firstColumn = std::min(r.firstColumn, column);
        r.lastColumn = std::max(r.lastColumn, column);
        r.firstRow = std::min(r.firstRow, row);
        r.lastRow = std::max(r.lastRow, row);
    }
    return r;
}

STROBE_TARGET_CLONES void computeIds(const GridPositionSoA& positions, int n, const GridRange& range,
                                     int columnBits, uint32_t* id) {
    const uint32_t firstColumn = range.firstColumn, firstRow = range.firstRow;
    STROBE_IVDEP
    for (int k = 0; k < n; ++k) {
        const uint32_t column = positions.column[k] - firstColumn, row = positions.row[k] - firstRow;
        id[k] = (row << columnBits | column) << 1 | positions.isUpper[k];
    }
}

/// Returns a set bit for each number from `first` to `first` + 63 that occurs among n numbers.
STROBE_TARGET_CLONES uint64_t findOccurring(const uint32_t* numbers, int n, uint32_t first) {
    uint64_t bits = 0;
    for (int k = 0; k < n; ++k) {
        const uint64_t bit = numbers[k] - first;
        bits |= uint64_t(bit < 64) << (bit & 63);
    }
    return bits;
}

} // namespace

bool PatchCells::find(const LatticePatch& patch, const HitSoA& hits, int count, V3SoA& coords) {
    GridPositionSoA positions;
    const GridRange range = findGridPositions(patch, hits, count, positions, coords);
    const uint32_t columns = range.lastColumn - range.firstColumn, rows = range.lastRow - range.firstRow;
    m_columnBits = std::bit_width(columns);
    if (m_columnBits > 5 || rows >= uint32_t(kMaxIds / 2) >> m_columnBits)
        return false;
    m_firstColumn = range.firstColumn;
    m_firstRow = range.firstRow;
    computeIds(positions, count, range, m_columnBits, m_id);
    m_idCount = int(rows + 1) << (m_columnBits + 1);
    m_occupied[0] = findOccurring(m_id, count, 0);
    m_occupied[1] = m_idCount > 64 ? findOccurring(m_id, count, 64) : 0;
    return true;
}

void PatchTable::clear() {
    for (NumberedPatch& known : m_patches)
        known.number = 0;
}

/// A patch that is still in m_patches keeps its number; any other gets a number that was never used.
void PatchTable::select(const LatticePatch& patch) {
    const auto exponent = [](float n) { return std::bit_cast<uint32_t>(n) >> 23; };
    const uint32_t hash =
        uint32_t(patch.keySum >> 60) + exponent(patch.nu) + 3 * exponent(patch.nv) + patch.isFront;
    NumberedPatch& entry = m_patches[hash % kPatches];
    const LatticePatch& p = entry.patch;
    const bool isKnown = entry.number && p.keySum == patch.keySum && p.nu == patch.nu && p.nv == patch.nv &&
                         p.isFront == patch.isFront;
    if (!isKnown && m_lastNumber == UINT32_MAX)
        *this = PatchTable();
    if (!isKnown)
        entry = {patch, ++m_lastNumber};
    m_selected = entry.number;
}

} // namespace strobe
