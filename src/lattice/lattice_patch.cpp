#include "lattice/lattice_patch.h"

#include <climits>

namespace strobe {

namespace {

/// The least and the greatest of numbers that are not negative: their bits are in the same order.
struct Range {
    int32_t least = INT_MAX, most = 0;
    float low() const { return std::bit_cast<float>(least); }
    float high() const { return std::bit_cast<float>(most); }
};

/// Of what a division depends on.
struct DivisionRanges {
    Range a2, b2, area2, block;
    int32_t anyFront = 0, anyBack = 0;
};

/// The same steps as in divideTriangle.
STROBE_TARGET_CLONES void findRanges(const VisibilitySoA& samples, int n, const Edges& edges,
                                     const LatticeSoA& cones, float blockSize, DivisionRanges& out) {
    const V3f a = edges.a, b = edges.b, normal = cross(a, b);
    Range a2Range, b2Range, area2Range, blockRange;
    int32_t anyFront = 0, anyBack = 0;
    const auto bits = [](float x) { return std::bit_cast<int32_t>(x); };
    for (int k = 0; k < n; ++k) {
        const V3f d = samples.ray.d.at(k);
        const float facing = dot(normal, d);
        const int32_t a2 = bits(seenLength2(a, d)), b2 = bits(seenLength2(b, d)), area2 = bits(sqr(facing));
        const int32_t block = bits(blockSize * (cones.width[k] + samples.hit.t[k] * cones.spread[k]));
        a2Range = {std::min(a2Range.least, a2), std::max(a2Range.most, a2)};
        b2Range = {std::min(b2Range.least, b2), std::max(b2Range.most, b2)};
        area2Range = {std::min(area2Range.least, area2), std::max(area2Range.most, area2)};
        blockRange = {std::min(blockRange.least, block), std::max(blockRange.most, block)};
        anyFront |= facing < 0, anyBack |= !(facing < 0);
    }
    out = {a2Range, b2Range, area2Range, blockRange, anyFront, anyBack};
}

} // namespace

bool LatticePatch::divide(const VisibilitySoA& samples, int count, const Edges& edges,
                          const LatticeSoA& cones, float blockSize, bool sharesSmall) {
    DivisionRanges r;
    findRanges(samples, count, edges, cones, blockSize, r);
    if (r.anyFront && r.anyBack)
        return false;
    // Rounded sums and products grow with what they are of, as divisions do: where those of the ends are
    // the same, so are all between.
    const float leastBlock2 = sqr(r.block.low()), mostBlock2 = sqr(r.block.high());
    if (sharesSmall && !(std::max(r.a2.low(), r.b2.low()) >= kUndivided * mostBlock2))
        return false;
    const float leastSine2 = sine2Of(r.a2.high(), r.b2.high(), r.area2.low());
    const float mostSine2 = sine2Of(r.a2.low(), r.b2.low(), r.area2.high());
    const auto isOne = [&](const Range& edge2, float& n) {
        const int least = divisionFor(sqr(edge2.low() * (1 / mostBlock2)) * leastSine2);
        const int most = divisionFor(sqr(edge2.high() * (1 / leastBlock2)) * mostSine2);
        n = partsOf(least);
        return least == most;
    };
    positive = r.anyFront;
    return isOne(r.a2, nu) && isOne(r.b2, nv);
}

namespace {

struct PlaceRange {
    uint32_t firstColumn = UINT32_MAX, lastColumn = 0, firstRow = UINT32_MAX, lastRow = 0;
};

STROBE_TARGET_CLONES PlaceRange findPlaces(const LatticePatch& patch, const HitSoA& hits, int n,
                                           uint32_t* columns, uint32_t* rows, uint32_t* uppers,
                                           V3SoA& place) {
    const float nu = patch.nu, nv = patch.nv;
    PlaceRange r;
    STROBE_IVDEP
    for (int k = 0; k < n; ++k) {
        const Divided at = divideBy(hits.u[k], hits.v[k], nu, nv);
        const bool upper = isUpper(at);
        const uint32_t column = uint32_t(int(at.i)), row = uint32_t(int(at.j));
        const float x = upper ? 1 - at.y : at.x, y = upper ? 1 - at.x : at.y;
        place.x[k] = x, place.y[k] = y, place.z[k] = firstWeight(x, y);
        columns[k] = column, rows[k] = row, uppers[k] = upper;
        r.firstColumn = std::min(r.firstColumn, column), r.lastColumn = std::max(r.lastColumn, column);
        r.firstRow = std::min(r.firstRow, row), r.lastRow = std::max(r.lastRow, row);
    }
    return r;
}

/// Numbers the places of a part of the mesh.
STROBE_TARGET_CLONES void numberPlaces(const PlaceRange& range, int columnBits, int n,
                                       const uint32_t* columns, const uint32_t* rows, const uint32_t* uppers,
                                       uint32_t* id) {
    const uint32_t firstColumn = range.firstColumn, firstRow = range.firstRow;
    STROBE_IVDEP
    for (int k = 0; k < n; ++k)
        id[k] = ((rows[k] - firstRow) << columnBits | (columns[k] - firstColumn)) << 1 | uppers[k];
}

/// Bits of those numbers from `first` to `first` + 63 that are there.
STROBE_TARGET_CLONES uint64_t bitsOf(const uint32_t* numbers, int n, uint32_t first) {
    uint64_t bits = 0;
    for (int k = 0; k < n; ++k) {
        const uint64_t bit = numbers[k] - first;
        bits |= uint64_t(bit < 64) << (bit & 63);
    }
    return bits;
}

} // namespace

bool PatchCells::find(const LatticePatch& patch, const HitSoA& hits, int count, V3SoA& place) {
    const PlaceRange range = findPlaces(patch, hits, count, m_column, m_row, m_isUpper, place);
    const uint32_t columns = range.lastColumn - range.firstColumn, rows = range.lastRow - range.firstRow;
    columnBits = std::bit_width(columns);
    if (columnBits > 5 || rows >= uint32_t(kMax / 2) >> columnBits)
        return false;
    firstColumn = range.firstColumn, firstRow = range.firstRow;
    numberPlaces(range, columnBits, count, m_column, m_row, m_isUpper, id);
    this->count = int(rows + 1) << (columnBits + 1);
    any[0] = bitsOf(id, count, 0), any[1] = this->count > 64 ? bitsOf(id, count, 64) : 0;
    return true;
}

void PatchTable::clear() {
    for (Numbered& known : m_patches)
        known.number = 0;
}

/// Known patches have the number that they had; others have one that nobody had.
void PatchTable::open(const LatticePatch& patch) {
    const auto exponent = [](float n) { return std::bit_cast<uint32_t>(n) >> 23; };
    const uint32_t mixed =
        uint32_t(patch.keySum >> 60) + exponent(patch.nu) + 3 * exponent(patch.nv) + patch.positive;
    Numbered& known = m_patches[mixed % kPatches];
    const LatticePatch& p = known.patch;
    const bool isKnown = known.number && p.keySum == patch.keySum && p.nu == patch.nu && p.nv == patch.nv &&
                         p.positive == patch.positive;
    if (!isKnown && m_last == UINT32_MAX)
        *this = PatchTable();
    if (!isKnown)
        known = {patch, ++m_last};
    m_patch = known.number;
}

} // namespace strobe
