#include "lattice/batch_lattice.h"

#include <bit>
#include <cstring>

namespace strobe {

namespace {

template <int kCount>
STROBE_FORCE_INLINE InterpolationTable::Value weighted(const InterpolationTable::Value* values,
                                                       const uint32_t* first, const float* weights) {
    InterpolationTable::Value sum = values[first[0]] * weights[0];
    for (int k = 1; k < kCount; ++k)
        sum += values[first[k]] * weights[k];
    return sum;
}

/// What a share takes of the values.
STROBE_FORCE_INLINE InterpolationTable::Value weighted(const InterpolationTable::Cell& cell,
                                                       const InterpolationTable::Firsts* more,
                                                       const V3f& place,
                                                       const InterpolationTable::Value* values) {
    float weights[LatticeCell::kPoints];
    if (!cell.hasMore()) {
        LatticeCell::weigh(LatticeCell::Lower, place, weights);
        return weighted<3>(values, cell.few, weights);
    }
    const uint32_t* firsts = more[cell.few[0]].data();
    if (cell.kind == LatticeCell::Rectangle) {
        LatticeCell::weigh(LatticeCell::Rectangle, place, weights);
        return weighted<4>(values, firsts, weights);
    }
    LatticeCell::weigh(LatticeCell::Grid, place, weights);
    const InterpolationTable::Value sum = weighted<8>(values, firsts, weights);
    return sum * (1 / sum[3]); // some may be missing
}

STROBE_TARGET_CLONES void takeWeighted(const InterpolationTable::Shares& shares,
                                       const InterpolationTable::Cell* cells,
                                       const InterpolationTable::Firsts* more, int binBits,
                                       const InterpolationTable::Value* values, Rgb* out, int n) {
    const uint32_t slots = (1u << binBits) - 1;
    InterpolationTable::Value mean{};
    for (int i = 0; i < n; ++i) {
        if (i > 0) // in one go, the last number over what comes next
            std::memcpy(static_cast<void*>(&out[i - 1]), &mean, sizeof mean);
        const uint32_t share = shares.cell[i];
        mean = share == kNone
                   ? InterpolationTable::Value{}
                   : weighted(cells[share >> binBits], more, shares.place.at(i), values + (share & slots));
    }
    out[n - 1] = Rgb(mean[0], mean[1], mean[2]);
}

} // namespace

void BatchLattice::take(std::span<Rgb> values) const {
    if (m_settings.nearest) {
        for (size_t i = 0; i < values.size(); ++i) {
            const Value value = has(i) ? m_values[shareOf(i)] : Value{};
            values[i] = {value[0], value[1], value[2]};
        }
        return;
    }
    for (size_t first = 0; first < values.size(); first += kSoAWidth)
        takeWeighted(m_shares[first / kSoAWidth], m_cells.data(), m_more.data(), m_binBits, m_values.data(),
                     &values[first], int(std::min<size_t>(kSoAWidth, values.size() - first)));
}

uint64_t BatchLattice::mainKeyOf(size_t sample) const {
    uint32_t value = shareOf(sample);
    const uint32_t slot = value & slots();
    if (!m_settings.nearest) {
        const Cell& cell = m_cells[value >> m_binBits];
        value = firstsOf(cell)[heaviestOf(cell, insideOf(sample))];
    }
    const Point& point = m_points[value >> m_binBits];
    return SurfaceLattice::keyOf(point.at, binOf(point, slot));
}

/// Of a cell's points, that with the greatest weight.
int BatchLattice::heaviestOf(const Cell& cell, const V3f& place) const {
    const uint32_t* firsts = firstsOf(cell);
    float weights[kPoints];
    LatticeCell::weigh(cell.kind, place, weights);
    int best = 0;
    float most = -1;
    for (int k = 0; k < LatticeCell::pointsOf(cell.kind); ++k)
        if (firsts[k] && weights[k] > most)
            best = k, most = weights[k];
    return best;
}

/// Of a cell's points, the nearest; if it is missing, of the others, which are a grid cell's, the one fewest
/// edges away.
int BatchLattice::nearestOf(const Cell& cell, const V3f& place) const {
    const uint32_t* firsts = firstsOf(cell);
    const int wanted = LatticeCell::nearest(cell.kind, place);
    if (firsts[wanted])
        return wanted;
    int best = wanted, fewest = kPoints;
    for (int k = 0; k < LatticeCell::pointsOf(cell.kind); ++k)
        if (const int edges = std::popcount(unsigned(k ^ wanted)); firsts[k] && edges < fewest)
            best = k, fewest = edges;
    return best;
}

} // namespace strobe
