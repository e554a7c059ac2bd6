#include "integrators/lattice_patch.h"

#include "integrators/lattice_division.h"

namespace strobe {

namespace {

/// Divides the triangle for each hit. Returns whether some are small.
STROBE_LANES bool dividePatch(LatticePatch& l, const VisibilityLanes& samples, const Edges& edges,
                              const LatticeLanes& cones, float blockSize, V3Lanes& place) {
    const int n = l.count;
    const V3f a = edges.a, b = edges.b;
    int32_t anySmall = 0;
    STROBE_INDEPENDENT
    for (int k = 0; k < n; ++k) {
        const float block = blockSize * (cones.width[k] + samples.hit.t[k] * cones.spread[k]);
        const DividedTriangle r =
            divideTriangle(a, b, samples.ray.d.at(k), samples.hit.u[k], samples.hit.v[k], block);
        l.column[k] = int32_t(r.at.i), l.row[k] = int32_t(r.at.j);
        l.nu[k] = r.at.nu, l.nv[k] = r.at.nv;
        l.isUpper[k] = r.upper, l.negative[k] = !(r.facing < 0);
        place.x[k] = r.upper ? 1 - r.at.y : r.at.x;
        place.y[k] = r.upper ? 1 - r.at.x : r.at.y;
        anySmall |= r.small;
    }
    return anySmall;
}

/// Whether all hits are divided like the first.
STROBE_LANES bool areAlike(const LatticePatch& l) {
    const int n = l.count;
    const float nu = l.nu[0], nv = l.nv[0];
    const int32_t negative = l.negative[0];
    int32_t differs = 0;
    for (int k = 0; k < n; ++k)
        differs |= (l.nu[k] != nu) | (l.nv[k] != nv) | (l.negative[k] ^ negative);
    return !differs;
}

/// The least number, and how many there are from there to the greatest.
STROBE_LANES void findRange(const int32_t* numbers, int n, int& first, int& count) {
    int32_t least = numbers[0], most = numbers[0];
    for (int k = 1; k < n; ++k)
        least = std::min(least, numbers[k]), most = std::max(most, numbers[k]);
    first = least, count = most - least + 1;
}

STROBE_LANES void numberCells(LatticePatch& l) {
    const int n = l.count;
    STROBE_INDEPENDENT
    for (int k = 0; k < n; ++k)
        l.cell[k] = ((l.row[k] - l.firstRow) * l.columns + l.column[k] - l.firstColumn) * 2 + l.isUpper[k];
}

} // namespace

bool LatticePatch::find(const VisibilityLanes& samples, int samplesCount, const Edges& edges, uint64_t sum,
                        const LatticeLanes& cones, float blockSize, bool sharesSmall, V3Lanes& place) {
    count = samplesCount, keySum = sum, prim = samples.hit.prim[0];
    const bool anySmall = dividePatch(*this, samples, edges, cones, blockSize, place);
    if ((anySmall && sharesSmall) || !areAlike(*this))
        return false;
    findRange(column, count, firstColumn, columns);
    findRange(row, count, firstRow, rows);
    if (columns >= kMostNodes || rows >= kMostNodes || (columns + 1) * (rows + 1) > kMostNodes)
        return false;
    numberCells(*this);
    return true;
}

namespace {

/// Of eight bytes: bits of those that are not 0, all below 128.
uint8_t bitsOfBytes(uint64_t bytes) {
    constexpr uint64_t kOnes = 0x0101010101010101, kGather = 0x0102040810204080;
    const uint64_t ones = (bytes + 0x7f * kOnes) >> 7 & kOnes;
    return uint8_t(ones * kGather >> 56);
}

} // namespace

void LatticePatch::list(const uint32_t* slot) {
    // By cell and slot, a byte each: 0, or 1 and the last hit's number. What is written is not read at once.
    static_assert(std::endian::native == std::endian::little, "the first slot is the lowest byte");
    uint64_t asked[2 * kMostNodes];
    std::fill_n(asked, 2 * columns * rows, 0);
    for (int k = 0; k < count; ++k)
        reinterpret_cast<uint8_t*>(asked)[cell[k] * 8 + int(slot[k])] = uint8_t(k + 1);

    constexpr uint8_t kUnlisted = 255;
    uint8_t number[kMostNodes];
    const int along = columns + 1;
    std::fill_n(number, along * (rows + 1), kUnlisted);
    nodes.count = cells = 0;
    const auto nodeAt = [&](int c, int r, uint8_t asking, uint8_t hitAsking) {
        uint8_t& node = number[r * along + c];
        if (node == kUnlisted) {
            node = uint8_t(nodes.count++);
            nodes.i[node] = float(firstColumn + c), nodes.j[node] = float(firstRow + r);
            slots[node] = 0, hit[node] = hitAsking;
        }
        slots[node] |= asking;
        return node;
    };
    for (int r = 0, k = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c)
            for (int upper = 0; upper < 2; ++upper, ++k) {
                if (!asked[k])
                    continue;
                const uint8_t bits = bitsOfBytes(asked[k]);
                const auto one = uint8_t((asked[k] >> 8 * std::countr_zero(bits) & 0xff) - 1);
                listed[cells++] = {k,
                                   {nodeAt(c + upper, r + upper, bits, one), nodeAt(c + 1, r, bits, one),
                                    nodeAt(c, r + 1, bits, one)}};
            }
    fillNodes();
}

void LatticePatch::fillNodes() {
    std::fill_n(nodes.lane, nodes.count, 0);
    std::fill_n(nodes.nu, nodes.count, nu[0]), std::fill_n(nodes.nv, nodes.count, nv[0]);
    std::fill_n(nodes.isUpper, nodes.count, 0), std::fill_n(nodes.positive, nodes.count, !negative[0]);
    std::fill_n(nodes.keySum, nodes.count, keySum), std::fill_n(nodes.points[0].prim, nodes.count, prim);
}

} // namespace strobe
