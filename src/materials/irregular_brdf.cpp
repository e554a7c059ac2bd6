#include "materials/irregular_brdf.h"

#include "core/math/fast_math.h"
#include "core/math/simd4.h"

#include <array>
#include <numeric>

namespace strobe {
namespace {

// Resolutions, per axis, of three nested grids over key space. Coarse boxes only narrow down the candidates
// for the next grid. A cube owns groups of samples. A cell refers to the groups of its cube that it needs.
constexpr int kCoarse = 4, kCubes = 16, kCells = 32;
constexpr uint32_t kMaxCandidates = 1008; ///< of a cube; below 2^10, the range of Lookup's counters
constexpr float kMaxRadius2 = 1.5f;       ///< above all finite search radii
constexpr float kSlack = 1e-5f;           ///< margin for rounding in lookups and in bounds

/// Returns the squared search radius: the first of pbrt-v2's radii that exceeds the distance of the third
/// nearest sample, whose square is `third2`.
float searchRadius2(float third2) {
    for (float r2 = .001f; r2 < kMaxRadius2; r2 *= 2)
        if (third2 < r2)
            return r2;
    return kInfinity;
}

/// The smallest interval [begin, end) that contains all included indices.
struct Range {
    uint32_t begin = ~0u, end = 0;
    void include(uint32_t i) {
        begin = std::min(begin, i);
        end = std::max(end, i + 1);
    }
};

/// The three smallest of the added numbers, ascending.
struct Smallest3 {
    float a = kInfinity, b = kInfinity, c = kInfinity;
    void add(float x) {
        c = std::min(c, std::max(b, x));
        b = std::min(b, std::max(a, x));
        a = std::min(a, x);
    }
};

} // namespace

/// A box of a regular grid over key space, with `perAxis` boxes along each axis.
struct IrregularBrdf::Box {
    std::array<int, 3> coords; ///< in the grid
    int perAxis;
    V3f lo; ///< the corner with the smallest coordinates
    float side;

    Box(const std::array<int, 3>& coords, int perAxis)
        : coords(coords), perAxis(perAxis),
          lo(V3f(float(coords[0]), float(coords[1]), float(coords[2])) / float(perAxis)),
          side(1.f / float(perAxis)) {}
    size_t index() const { return size_t(coords[0] + perAxis * (coords[1] + perAxis * coords[2])); }
    /// Returns false if sinθi sinθo + cosθi cosθo > 1 in the whole box: no pair of directions has such a key.
    bool isPossible() const { return lo.x + lo.z < 1 + kSlack; }
    /// Returns the squared distance of the box from `p`; 0 inside.
    float distance2(const V3f& p) const {
        float d2 = 0;
        for (int k = 0; k < 3; ++k)
            d2 += sqr(std::max({lo[k] - p[k], p[k] - lo[k] - side, 0.f}));
        return d2;
    }
};

namespace {

/// Calls `visit` for each possible box of the grid of `perAxis` that lies in the box `coords` of the coarser
/// grid of `outerPerAxis`.
template <class Visit>
void forEachBox(const std::array<int, 3>& coords, int outerPerAxis, int perAxis, const Visit& visit) {
    const int n = perAxis / outerPerAxis;
    for (int i = 0; i < n * n * n; ++i) {
        const IrregularBrdf::Box box(
            {coords[0] * n + i % n, coords[1] * n + i / n % n, coords[2] * n + i / n / n}, perAxis);
        if (box.isPossible())
            visit(box);
    }
}

} // namespace

IrregularBrdf::IrregularBrdf(std::vector<Sample> samples) : m_samples(std::move(samples)) { buildCells(); }

namespace {

STROBE_FORCE_INLINE V3f keyOfPair(const V3f& wo, const V3f& wi) {
    const float sines = std::sqrt((wo.x * wo.x + wo.y * wo.y) * (wi.x * wi.x + wi.y * wi.y));
    const float dPhi = fastAtan2(std::abs(wo.x * wi.y - wo.y * wi.x), wo.x * wi.x + wo.y * wi.y);
    return {std::min(sines, 1.f), std::min(dPhi * kInvPi, 1.f), wo.z * wi.z};
}

STROBE_TARGET_CLONES void keysOfPairs(const V3SoA& wo, const V3SoA& wi, int begin, int end, V3SoA& keys) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const V3f key = keyOfPair(wo.at(i), wi.at(i));
        keys.x[i] = key.x;
        keys.y[i] = key.y;
        keys.z[i] = key.z;
    }
}

} // namespace

V3f IrregularBrdf::keyOf(const V3f& wo, const V3f& wi) { return keyOfPair(wo, wi); }

void IrregularBrdf::keySoA(const V3SoA& wo, const V3SoA& wi, int begin, int end, V3SoA& keys) {
    keysOfPairs(wo, wi, begin, end, keys);
}

IrregularBrdf::RadiusBounds IrregularBrdf::boundRadius(const Box& box, const Indices& candidates) const {
    const V3f center = box.lo + V3f(box.side / 2);
    const float halfDiagonal = box.side * std::sqrt(3.f) / 2 + kSlack;
    Smallest3 nearest;
    for (const uint32_t k : candidates)
        nearest.add(length2(m_samples[k].key - center));
    // The distance of the third nearest sample is Lipschitz continuous with constant 1.
    const float third = std::sqrt(nearest.c);
    return {searchRadius2(sqr(std::max(0.f, third - halfDiagonal))),
            searchRadius2(sqr(third + halfDiagonal))};
}

IrregularBrdf::Indices IrregularBrdf::selectSamples(const Box& box, const Indices& candidates) const {
    const float r = std::sqrt(boundRadius(box, candidates).max) + kSlack;
    Indices result;
    for (const uint32_t k : candidates)
        if (box.distance2(m_samples[k].key) <= r * r)
            result.push_back(k);
    return result;
}

void IrregularBrdf::buildCells() {
    Indices all(m_samples.size());
    std::iota(all.begin(), all.end(), 0u);
    std::sort(all.begin(), all.end(), [&](uint32_t a, uint32_t b) {
        return m_samples[a].key.z < m_samples[b].key.z; // so that the samples of a cell are close in the list
    });
    m_cells.resize(size_t(kCells) * kCells * kCells);
    forEachBox({0, 0, 0}, 1, kCoarse, [&](const Box& coarse) {
        const Indices candidates = selectSamples(coarse, all);
        forEachBox(coarse.coords, kCoarse, kCubes,
                   [&](const Box& cube) { buildCube(cube, selectSamples(cube, candidates)); });
    });
}

void IrregularBrdf::buildCube(const Box& cube, const Indices& candidates) {
    constexpr int kPerAxis = kCells / kCubes;
    static_assert(kPerAxis * kPerAxis * kPerAxis <= 8, "cells of a cube are bits");
    std::vector<uint8_t> neededBy(candidates.size()); // bit k: cell k needs the candidate
    std::vector<std::pair<Cell*, Range>> cells;
    forEachBox(cube.coords, kCubes, kCells, [&](const Box& box) {
        const RadiusBounds radius2 = boundRadius(box, candidates);
        const float r = std::sqrt(radius2.max) + kSlack;
        for (size_t i = 0; i < candidates.size(); ++i)
            neededBy[i] |= uint8_t((box.distance2(m_samples[candidates[i]].key) <= r * r) << cells.size());
        Cell& cell = m_cells[box.index()];
        cell.minRadius2 = radius2.min;
        cells.push_back({&cell, {}});
    });
    Indices list; // the candidates that a cell needs; fewer than the bounds of the whole cube select
    for (size_t i = 0; i < candidates.size(); ++i) {
        if (neededBy[i] == 0)
            continue;
        for (size_t k = 0; k < cells.size(); ++k)
            if (neededBy[i] >> k & 1)
                cells[k].second.include(uint32_t(list.size()));
        list.push_back(candidates[i]);
    }
    if (list.size() > kMaxCandidates)
        return;
    for (auto& [cell, range] : cells) {
        if (cell->minRadius2 == kInfinity)
            continue;
        const uint32_t first = range.begin / Group::kSize;
        cell->first = uint32_t(m_groups.size()) + first;
        cell->count = (range.end + Group::kSize - 1) / Group::kSize - first;
    }
    addGroups(list);
}

void IrregularBrdf::addGroups(const Indices& indices) {
    const Sample padding{V3f(100), Rgb(0)}; // beyond all search radii
    for (size_t i = 0; i < indices.size() || i % Group::kSize != 0; ++i) {
        const size_t k = i % Group::kSize;
        if (k == 0)
            m_groups.emplace_back();
        const Sample& s = i < indices.size() ? m_samples[indices[i]] : padding;
        Group& group = m_groups.back();
        group.x[k] = s.key.x;
        group.y[k] = s.key.y;
        group.z[k] = s.key.z;
        group.r[k] = s.value.x;
        group.g[k] = s.value.y;
        group.b[k] = s.value.z;
    }
}

namespace {

using Floats = IrregularBrdf::Group::Floats;
using Ints = IrregularBrdf::Group::Ints;

/// Returns four partial sums of 16 numbers.
template <class Vector16>
STROBE_FORCE_INLINE auto foldToFour(const Vector16& v) {
    const auto h = __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7) +
                   __builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15);
    return __builtin_shufflevector(h, h, 0, 1, 2, 3) + __builtin_shufflevector(h, h, 4, 5, 6, 7);
}

STROBE_FORCE_INLINE int32_t sumOf(const Ints& v) {
    const auto q = foldToFour(v);
    return (q[0] + q[2]) + (q[1] + q[3]);
}

/// Returns the sums of four vectors.
STROBE_FORCE_INLINE Float4 sumsOf(const Floats& a, const Floats& b, const Floats& c, const Floats& d) {
    const Float4 p = foldToFour(a), q = foldToFour(b), r = foldToFour(c), s = foldToFour(d);
    const Float4 pq = __builtin_shufflevector(p, q, 0, 4, 1, 5) + __builtin_shufflevector(p, q, 2, 6, 3, 7);
    const Float4 rs = __builtin_shufflevector(r, s, 0, 4, 1, 5) + __builtin_shufflevector(r, s, 2, 6, 3, 7);
    return __builtin_shufflevector(pq, rs, 0, 1, 4, 5) + __builtin_shufflevector(pq, rs, 2, 3, 6, 7);
}

/// A lookup of one key in the groups of its cell.
struct Lookup {
    const IrregularBrdf::Group* groups;
    uint32_t count;
    int32_t index; ///< of the key
    float radius2; ///< squared search radius; at first a lower bound of it

    /// Returns the squared search radius; infinity if all samples count.
    STROBE_FORCE_INLINE float findRadius2(const V3f& key) const {
        // Tests three radii at a time: bits 0 …, 10 … and 20 … count the samples within each.
        for (float r2 = radius2; r2 < kMaxRadius2; r2 *= 8) {
            Ints found{};
            for (uint32_t i = 0; i < count; ++i) {
                const Floats x = groups[i].x - key.x, y = groups[i].y - key.y, z = groups[i].z - key.z;
                const Floats d2 = x * x + y * y + z * z;
                found += ((d2 < r2) & 1) + ((d2 < 2 * r2) & 1 << 10) + ((d2 < 4 * r2) & 1 << 20);
            }
            const int32_t n = sumOf(found);
            if (n >> 20 > 2)
                return r2 * float(1 << (int((n & 1023) <= 2) + int((n >> 10 & 1023) <= 2)));
        }
        return kInfinity;
    }

    /// Returns the weighted mean of the samples within the radius.
    STROBE_FORCE_INLINE Rgb mean(const V3f& key) const {
        Floats w{}, red{}, green{}, blue{};
        for (uint32_t i = 0; i < count; ++i) {
            const IrregularBrdf::Group& s = groups[i];
            const Floats x = s.x - key.x, y = s.y - key.y, z = s.z - key.z, d2 = x * x + y * y + z * z;
            // Weights are relative to the weight at d² = r²/2: the quotient is the same, but it can be
            // neither 0/0 nor infinite. exp(100 …) is 2^(k + u): adding 1.5 2^23 rounds to k, and the
            // polynomial is the minimax approximation of 2^u for |u| <= 1/2 (relative error 9e-8; Remez
            // exchange). Beyond r² the result is unspecified and masked out.
            const Floats power = (100 * 1.44269504f) * (radius2 / 2 - d2), k = power + 12582912.f;
            const Floats u = power - (k - 12582912.f);
            const Floats fraction =
                1.f +
                u * (.693147f + u * (.24022242f + u * (.055507336f + u * (.009671513f + u * .0013264727f))));
            const Ints bits = (Ints)fraction + ((Ints)k << 23);
            const Floats weight = (Floats)((d2 < radius2) & bits);
            w += weight;
            red += s.r * weight;
            green += s.g * weight;
            blue += s.b * weight;
        }
        const Float4 sums = sumsOf(red, green, blue, w), mean = sums * (1 / sums[3]);
        return Rgb(mean[0], mean[1], mean[2]);
    }
};

} // namespace

/// The cells and groups, as plain pointers.
struct IrregularBrdf::Grid {
    const Cell* cells;
    const Group* groups;

    /// Evaluates the keys `begin` to `end` except those whose lookup needs all samples. Writes the indices of
    /// these to `missing` and returns their number. Each step runs for all keys before the next step starts,
    /// so that memory latencies of different keys overlap.
    static int evalSoA(const Grid& grid, const V3SoA& keys, const int32_t* mask, int begin, int end,
                       RgbSoA& out, int32_t* missing);
};

STROBE_TARGET_CLONES int IrregularBrdf::Grid::evalSoA(const Grid& grid, const V3SoA& keys,
                                                      const int32_t* mask, int begin, int end, RgbSoA& out,
                                                      int32_t* missing) {
    int32_t cellIndex[kSoAWidth];
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const int x = std::min(int(std::max(0.f, keys.x[i]) * kCells), kCells - 1);
        const int y = std::min(int(std::max(0.f, keys.y[i]) * kCells), kCells - 1);
        const int z = std::min(int(std::max(0.f, keys.z[i]) * kCells), kCells - 1);
        cellIndex[i] = x + kCells * (y + kCells * z);
    }
    Lookup lookups[kSoAWidth];
    int n = 0, missingCount = 0;
    for (int i = begin; i < end; ++i) {
        const Cell cell = grid.cells[cellIndex[i]];
        if (mask && !mask[i])
            out.set(i, Rgb(0));
        else if (!(keys.z[i] >= 0) ||
                 cell.count == 0) // directions on opposite sides have keys outside the grid
            missing[missingCount++] = i;
        else
            lookups[n++] = {grid.groups + cell.first, cell.count, i, cell.minRadius2};
    }
    for (int k = 0; k < n; ++k)
        lookups[k].radius2 = lookups[k].findRadius2(keys.at(lookups[k].index));
    for (int k = 0; k < n; ++k)
        if (lookups[k].radius2 < kMaxRadius2)
            out.set(lookups[k].index, lookups[k].mean(keys.at(lookups[k].index)));
        else
            missing[missingCount++] = lookups[k].index;
    return missingCount;
}

Rgb IrregularBrdf::eval(const V3f& key) const {
    V3SoA keys;
    RgbSoA mean;
    keys.set(0, key);
    evalSoA(keys, nullptr, 0, 1, mean);
    return mean.at(0);
}

void IrregularBrdf::evalSoA(const V3SoA& keys, const int32_t* mask, int begin, int end, RgbSoA& out) const {
    int32_t missing[kSoAWidth];
    const Grid grid{m_cells.data(), m_groups.data()};
    const int count = Grid::evalSoA(grid, keys, mask, begin, end, out, missing);
    for (int i = 0; i < count; ++i)
        out.set(missing[i], evalBruteForce(keys.at(missing[i])));
}

Rgb IrregularBrdf::evalBruteForce(const V3f& key) const {
    Smallest3 nearest;
    for (const Sample& s : m_samples)
        nearest.add(length2(s.key - key));
    const float r2 = searchRadius2(nearest.c);
    Rgb sum(0);
    float weights = 0;
    for (const Sample& s : m_samples) {
        const float d2 = length2(s.key - key);
        if (!(d2 < r2))
            continue;
        const float weight =
            std::exp(-100 * (d2 - nearest.a)); // relative to the nearest sample, so never 0/0
        sum += s.value * weight;
        weights += weight;
    }
    return sum / weights;
}

} // namespace strobe
