#include "lattice/interpolation_table.h"

#include <bit>
#include <cstring>

namespace strobe {

TimeBinGroups::TimeBinGroups(int timeBins)
    : bits(std::min(int(std::bit_width(uint32_t(timeBins - 1))), kMaxBits)) {}

InterpolationTable::InterpolationTable(int timeBins) : m_groups(timeBins) { clear(); }

void InterpolationTable::clear() {
    m_cells.clear();
    m_manyPoints.clear();
    m_points.assign(1,
                    Point{{}, {}, 0, ~0u}); // all bits are set, so that the missing point is never requested
    m_values.resize(std::max(m_values.size(), size_t(m_groups.binCount()))); // the missing point's stay 0
    m_cellIndex.clear();
    m_pointIndex.clear();
}

void InterpolationTable::setPoints(Cell& cell, const PointValues& points) {
    if (!cell.hasManyPoints()) {
        std::copy_n(points.begin(), 3, cell.pointValues);
        return;
    }
    cell.pointValues[0] = uint32_t(m_manyPoints.size());
    m_manyPoints.push_back(points);
}

uint32_t InterpolationTable::findOrAddPoint(uint64_t key, const SurfaceSide& side, const LatticePoint& point,
                                            uint32_t group) {
    const uint32_t next = uint32_t(m_points.size()), index = m_pointIndex.findOrInsert(key, next);
    if (index == next) {
        m_points.push_back({side, point, group, 0});
        if (m_points.size() << m_groups.bits > m_values.size())
            m_values.resize(2 * m_points.size() << m_groups.bits);
    }
    return index;
}

namespace {

using Value = InterpolationTable::Value;

template <int kCount>
STROBE_FORCE_INLINE Value weightedSum(const Value* values, const uint32_t* points, const float* weights) {
    Value sum = values[points[0]] * weights[0];
    for (int k = 1; k < kCount; ++k)
        sum += values[points[k]] * weights[k];
    return sum;
}

/// Returns the interpolated value at `coords` of a cell; `values` starts at the time bin in its group.
STROBE_FORCE_INLINE Value interpolateInCell(const InterpolationTable::Cell& cell,
                                            const InterpolationTable::PointValues* manyPoints,
                                            const V3f& coords, const Value* values) {
    float weights[LatticeCell::kMaxPoints];
    if (!cell.hasManyPoints()) {
        LatticeCell::computeWeights(LatticeCell::Lower, coords, weights);
        return weightedSum<3>(values, cell.pointValues, weights);
    }
    const uint32_t* points = manyPoints[cell.pointValues[0]].data();
    if (cell.kind == LatticeCell::Rectangle) {
        LatticeCell::computeWeights(LatticeCell::Rectangle, coords, weights);
        return weightedSum<4>(values, points, weights);
    }
    LatticeCell::computeWeights(LatticeCell::Grid, coords, weights);
    const Value sum = weightedSum<8>(values, points, weights);
    return sum * (1 / sum[3]); // some points may be missing
}

STROBE_TARGET_CLONES void interpolateSoA(const InterpolationSoA& samples,
                                         const InterpolationTable::Cell* cells,
                                         const InterpolationTable::PointValues* manyPoints, int binBits,
                                         const Value* values, Rgb* out, int n) {
    const uint32_t binMask = (1u << binBits) - 1;
    Value value{};
    for (int i = 0; i < n; ++i) {
        if (i > 0) // stores 16 bytes at once: the fourth number is overwritten by the next sample's value
            std::memcpy(static_cast<void*>(&out[i - 1]), &value, sizeof value);
        const uint32_t source = samples.source[i];
        value = source == kNone ? Value{}
                                : interpolateInCell(cells[source >> binBits], manyPoints,
                                                    samples.coords.at(i), values + (source & binMask));
    }
    out[n - 1] = Rgb(value[0], value[1], value[2]);
}

} // namespace

void InterpolationTable::interpolate(const InterpolationSoA& samples, std::span<Rgb> values) const {
    interpolateSoA(samples, m_cells.data(), m_manyPoints.data(), m_groups.bits, m_values.data(),
                   values.data(), int(values.size()));
}

void InterpolationTable::interpolateNearest(const InterpolationSoA& samples, std::span<Rgb> values) const {
    for (size_t i = 0; i < values.size(); ++i) {
        const uint32_t source = samples.source[i];
        const Value value = source == kNone ? Value{} : m_values[source];
        values[i] = {value[0], value[1], value[2]};
    }
}

uint32_t InterpolationTable::heaviestPointValue(uint32_t index, const V3f& coords) const {
    const Cell& cell = m_cells[index];
    const uint32_t* points = pointValuesOf(cell);
    float weights[LatticeCell::kMaxPoints];
    LatticeCell::computeWeights(cell.kind, coords, weights);
    int heaviest = 0;
    float maxWeight = -1;
    for (int k = 0; k < LatticeCell::pointCountOf(cell.kind); ++k) {
        if (points[k] && weights[k] > maxWeight) {
            heaviest = k;
            maxWeight = weights[k];
        }
    }
    return points[heaviest];
}

uint32_t InterpolationTable::nearestPointValue(uint32_t index, const V3f& coords) const {
    const Cell& cell = m_cells[index];
    const uint32_t* points = pointValuesOf(cell);
    const int nearest = LatticeCell::nearestPoint(cell.kind, coords);
    if (points[nearest])
        return points[nearest];
    int replacement = nearest, minEdges = LatticeCell::kMaxPoints;
    for (int k = 0; k < LatticeCell::pointCountOf(cell.kind); ++k) {
        if (const int edges = std::popcount(unsigned(k ^ nearest)); points[k] && edges < minEdges) {
            replacement = k;
            minEdges = edges;
        }
    }
    return points[replacement];
}

} // namespace strobe
