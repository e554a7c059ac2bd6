#include "materials/irregular_brdf.h"

#include "core/color/spectrum.h"
#include "core/math/fast_math.h"
#include "core/math/simd4.h"

#include <array>
#include <charconv>
#include <fstream>
#include <numeric>
#include <span>
#include <sstream>
#include <string>

namespace strobe {
namespace {

/// Blocks of key space along an axis: coarse ones, which only narrow down what the next look at; cubes, each
/// with groups of samples; and cells, which say which of these they need.
constexpr int kCoarse = 4, kCubes = 16, kCells = 32;
constexpr uint32_t kMaxCandidates = 1008; ///< below 2^10
constexpr float kMaxRadius2 = 1.5f;       ///< no search is wider, but for that of all samples
constexpr float kSlack = 1e-5f;           ///< for rounding, of lookups and of the bounds here

/// r² of the search: the first of pbrt's radii that lies beyond three samples, given the squared distance of
/// the third nearest.
float searchRadius2(float third2) {
    for (float r2 = .001f; r2 < kMaxRadius2; r2 *= 2)
        if (third2 < r2)
            return r2;
    return kInfinity;
}

/// The indices seen, and those between.
struct Range {
    uint32_t begin = ~0u, end = 0;
    void include(uint32_t i) { begin = std::min(begin, i), end = std::max(end, i + 1); }
};

/// The three smallest of the numbers seen.
struct Smallest3 {
    float a = kInfinity, b = kInfinity, c = kInfinity;
    void add(float x) {
        c = std::min(c, std::max(b, x));
        b = std::min(b, std::max(a, x));
        a = std::min(a, x);
    }
};

} // namespace

/// A cube of key space: one of so many along an axis.
struct IrregularBrdf::Block {
    std::array<int, 3> at;
    int perAxis;
    V3f lo;
    float side;

    Block(const std::array<int, 3>& at, int perAxis)
        : at(at), perAxis(perAxis), lo(V3f(float(at[0]), float(at[1]), float(at[2])) / float(perAxis)),
          side(1.f / float(perAxis)) {}
    size_t index() const { return size_t(at[0] + perAxis * (at[1] + perAxis * at[2])); }
    /// False where sinθi sinθo + cosθi cosθo > 1: no pair of directions has such a key.
    bool isPossible() const { return lo.x + lo.z < 1 + kSlack; }
    float distance2(const V3f& p) const {
        float d2 = 0;
        for (int k = 0; k < 3; ++k)
            d2 += sqr(std::max({lo[k] - p[k], p[k] - lo[k] - side, 0.f}));
        return d2;
    }
};

namespace {

/// The possible blocks of `perAxis` along an axis that lie in one, `at`, of `outer` along it.
template <class Do>
void forEachBlock(const std::array<int, 3>& at, int outer, int perAxis, const Do& visit) {
    const int n = perAxis / outer;
    for (int i = 0; i < n * n * n; ++i) {
        const IrregularBrdf::Block block({at[0] * n + i % n, at[1] * n + i / n % n, at[2] * n + i / n / n},
                                         perAxis);
        if (block.isPossible())
            visit(block);
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
        keys.x[i] = key.x, keys.y[i] = key.y, keys.z[i] = key.z;
    }
}

} // namespace

V3f IrregularBrdf::keyOf(const V3f& wo, const V3f& wi) { return keyOfPair(wo, wi); }

void IrregularBrdf::keySoA(const V3SoA& wo, const V3SoA& wi, int begin, int end, V3SoA& keys) {
    keysOfPairs(wo, wi, begin, end, keys);
}

IrregularBrdf::Search IrregularBrdf::searchOf(const Block& block, const List& candidates) const {
    const V3f center = block.lo + V3f(block.side / 2);
    const float halfDiagonal = block.side * std::sqrt(3.f) / 2 + kSlack;
    Smallest3 nearest;
    for (const uint32_t k : candidates)
        nearest.add(length2(m_samples[k].key - center));
    // The distance of the third nearest sample changes no faster than the point moves.
    const float third = std::sqrt(nearest.c);
    return {searchRadius2(sqr(std::max(0.f, third - halfDiagonal))),
            searchRadius2(sqr(third + halfDiagonal))};
}

IrregularBrdf::List IrregularBrdf::needed(const Block& block, const List& candidates) const {
    const float r = std::sqrt(searchOf(block, candidates).most) + kSlack;
    List result;
    for (const uint32_t k : candidates)
        if (block.distance2(m_samples[k].key) <= r * r)
            result.push_back(k);
    return result;
}

void IrregularBrdf::buildCells() {
    List all(m_samples.size());
    std::iota(all.begin(), all.end(), 0u);
    std::sort(all.begin(), all.end(), [&](uint32_t a, uint32_t b) {
        return m_samples[a].key.z < m_samples[b].key.z; // so that a cell needs neighbors
    });
    m_cells.resize(size_t(kCells) * kCells * kCells);
    forEachBlock({0, 0, 0}, 1, kCoarse, [&](const Block& coarse) {
        const List near = needed(coarse, all);
        forEachBlock(coarse.at, kCoarse, kCubes,
                     [&](const Block& cube) { buildCube(cube, needed(cube, near)); });
    });
}

void IrregularBrdf::buildCube(const Block& cube, const List& candidates) {
    constexpr int kPer = kCells / kCubes;
    static_assert(kPer * kPer * kPer <= 8, "cells of a cube are bits");
    std::vector<uint8_t> neededBy(candidates.size());
    std::vector<std::pair<Cell*, Range>> cells;
    forEachBlock(cube.at, kCubes, kCells, [&](const Block& block) {
        const Search search = searchOf(block, candidates);
        const float r = std::sqrt(search.most) + kSlack;
        for (size_t i = 0; i < candidates.size(); ++i)
            neededBy[i] |= uint8_t((block.distance2(m_samples[candidates[i]].key) <= r * r) << cells.size());
        Cell& cell = m_cells[block.index()];
        cell.least = search.least;
        cells.push_back({&cell, {}});
    });
    List list; // of what a cell needs, which is less than the cube seems to need
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
        if (cell->least == kInfinity)
            continue;
        const uint32_t first = range.begin / Group::kSize;
        cell->first = uint32_t(m_groups.size()) + first;
        cell->count = (range.end + Group::kSize - 1) / Group::kSize - first;
    }
    addGroups(list);
}

void IrregularBrdf::addGroups(const List& list) {
    const Sample far{V3f(100), Rgb(0)}; // beyond all radii
    for (size_t i = 0; i < list.size() || i % Group::kSize != 0; ++i) {
        const size_t k = i % Group::kSize;
        if (k == 0)
            m_groups.emplace_back();
        const Sample& s = i < list.size() ? m_samples[list[i]] : far;
        Group& group = m_groups.back();
        group.x[k] = s.key.x, group.y[k] = s.key.y, group.z[k] = s.key.z;
        group.r[k] = s.value.x, group.g[k] = s.value.y, group.b[k] = s.value.z;
    }
}

namespace {

using Row = IrregularBrdf::Group::Row;
using Ints = IrregularBrdf::Group::Ints;

/// Float4 sums that add up to that of a row's sixteen numbers.
template <class Sixteen>
STROBE_FORCE_INLINE auto foldedOf(const Sixteen& v) {
    const auto h = __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7) +
                   __builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15);
    return __builtin_shufflevector(h, h, 0, 1, 2, 3) + __builtin_shufflevector(h, h, 4, 5, 6, 7);
}

/// The sum of a row's sixteen numbers.
STROBE_FORCE_INLINE int32_t sumOf(const Ints& v) {
    const auto q = foldedOf(v);
    return (q[0] + q[2]) + (q[1] + q[3]);
}

/// The sums of four rows.
STROBE_FORCE_INLINE Float4 sumsOf(const Row& a, const Row& b, const Row& c, const Row& d) {
    const Float4 p = foldedOf(a), q = foldedOf(b), r = foldedOf(c), s = foldedOf(d);
    const Float4 pq = __builtin_shufflevector(p, q, 0, 4, 1, 5) + __builtin_shufflevector(p, q, 2, 6, 3, 7),
                 rs = __builtin_shufflevector(r, s, 0, 4, 1, 5) + __builtin_shufflevector(r, s, 2, 6, 3, 7);
    return __builtin_shufflevector(pq, rs, 0, 1, 4, 5) + __builtin_shufflevector(pq, rs, 2, 3, 6, 7);
}

/// A key's samples and the squared radius within which they count: at first one that is not too large.
struct TextureOptions {
    const IrregularBrdf::Group* groups;
    uint32_t count;
    int32_t lane;
    float r2;

    /// The search's squared radius; infinite where all samples count.
    STROBE_FORCE_INLINE float radius2(const V3f& key) const {
        // Three radii at a time: bits 0 …, 10 … and 20 … count what each finds.
        for (float least = r2; least < kMaxRadius2; least *= 8) {
            Ints found{};
            for (uint32_t i = 0; i < count; ++i) {
                const Row x = groups[i].x - key.x, y = groups[i].y - key.y, z = groups[i].z - key.z,
                          d2 = x * x + y * y + z * z;
                found += ((d2 < least) & 1) + ((d2 < 2 * least) & 1 << 10) + ((d2 < 4 * least) & 1 << 20);
            }
            const int32_t n = sumOf(found);
            if (n >> 20 > 2)
                return least * float(1 << (int((n & 1023) <= 2) + int((n >> 10 & 1023) <= 2)));
        }
        return kInfinity;
    }

    /// The mean of those within the radius.
    STROBE_FORCE_INLINE Rgb mean(const V3f& key) const {
        Row w{}, red{}, green{}, blue{};
        for (uint32_t i = 0; i < count; ++i) {
            const IrregularBrdf::Group& s = groups[i];
            const Row x = s.x - key.x, y = s.y - key.y, z = s.z - key.z, d2 = x * x + y * y + z * z;
            // Weights are relative to that at d² = r²/2: the same quotient, but it can be neither 0/0 nor
            // infinite. e^(100 …) is 2^(k + u): adding 1.5 2^23 rounds to k, and the polynomial is that with
            // the least relative error (9e-8) for |u| <= 1/2 (found by exchange). Beyond r² it is anything.
            const Row power = (100 * 1.44269504f) * (r2 / 2 - d2), k = power + 12582912.f,
                      u = power - (k - 12582912.f);
            const Row fraction =
                1.f +
                u * (.693147f + u * (.24022242f + u * (.055507336f + u * (.009671513f + u * .0013264727f))));
            const Ints near = (Ints)fraction + ((Ints)k << 23);
            const Row weight = (Row)((d2 < r2) & near);
            w += weight, red += s.r * weight, green += s.g * weight, blue += s.b * weight;
        }
        const Float4 sums = sumsOf(red, green, blue, w), mean = sums * (1 / sums[3]);
        return Rgb(mean[0], mean[1], mean[2]);
    }
};

} // namespace

/// What lookups read.
struct IrregularBrdf::Grid {
    const Cell* cells;
    const Group* groups;

    /// missing[0 … ] of the result: lanes where all samples are to be looked at. Step by step for all lanes:
    /// while one waits, others go on.
    static int evalSoA(const Grid& grid, const V3SoA& keys, const int32_t* wanted, int begin, int end,
                       RgbSoA& out, int32_t* missing);
};

STROBE_TARGET_CLONES int IrregularBrdf::Grid::evalSoA(const Grid& grid, const V3SoA& keys,
                                                      const int32_t* wanted, int begin, int end, RgbSoA& out,
                                                      int32_t* missing) {
    int32_t cell[kSoAWidth];
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const int x = std::min(int(std::max(0.f, keys.x[i]) * kCells), kCells - 1),
                  y = std::min(int(std::max(0.f, keys.y[i]) * kCells), kCells - 1),
                  z = std::min(int(std::max(0.f, keys.z[i]) * kCells), kCells - 1);
        cell[i] = x + kCells * (y + kCells * z);
    }
    TextureOptions lookups[kSoAWidth];
    int n = 0, missed = 0;
    for (int i = begin; i < end; ++i) {
        const Cell of = grid.cells[cell[i]];
        if (wanted && !wanted[i])
            out.set(i, Rgb(0));
        else if (!(keys.z[i] >= 0) || of.count == 0) // through the horizon, keys are outside the grid
            missing[missed++] = i;
        else
            lookups[n++] = {grid.groups + of.first, of.count, i, of.least};
    }
    for (int k = 0; k < n; ++k)
        lookups[k].r2 = lookups[k].radius2(keys.at(lookups[k].lane));
    for (int k = 0; k < n; ++k)
        if (lookups[k].r2 < kMaxRadius2)
            out.set(lookups[k].lane, lookups[k].mean(keys.at(lookups[k].lane)));
        else
            missing[missed++] = lookups[k].lane;
    return missed;
}

Rgb IrregularBrdf::eval(const V3f& key) const {
    V3SoA keys;
    RgbSoA mean;
    keys.set(0, key);
    evalSoA(keys, nullptr, 0, 1, mean);
    return mean.at(0);
}

void IrregularBrdf::evalSoA(const V3SoA& keys, const int32_t* wanted, int begin, int end, RgbSoA& out) const {
    int32_t missing[kSoAWidth];
    const Grid grid{m_cells.data(), m_groups.data()};
    const int count = Grid::evalSoA(grid, keys, wanted, begin, end, out, missing);
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
        const float weight = std::exp(-100 * (d2 - nearest.a)); // relative to the nearest: never 0/0
        sum += s.value * weight;
        weights += weight;
    }
    return sum / weights;
}

namespace {

/// All numbers of a text, without what follows a #.
std::vector<float> readNumbers(const std::filesystem::path& path, const Location& where) {
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw Error(where, "cannot read the BRDF file " + path.string());
    std::ostringstream buffer;
    buffer << file.rdbuf();
    const std::string text = buffer.str();
    std::vector<float> numbers;
    for (const char *p = text.data(), *end = p + text.size(); p != end;) {
        if (*p == '#') {
            p = std::find(p, end, '\n');
        } else if (*p == ' ' || (*p >= '\t' && *p <= '\r')) {
            ++p;
        } else {
            float value;
            const auto [next, error] = std::from_chars(p, end, value);
            if (error != std::errc() || !std::isfinite(value))
                throw Error(where, "BRDF file " + path.string() + ", line " +
                                       std::to_string(1 + std::count(text.data(), p, '\n')) +
                                       ": not a number");
            numbers.push_back(value);
            p = next;
        }
    }
    return numbers;
}

V3f direction(float theta, float phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

} // namespace

std::vector<IrregularBrdf::Sample> readIrregularBrdf(const std::filesystem::path& path,
                                                     const Location& where) {
    const std::vector<float> numbers = readNumbers(path, where);
    const auto fail = [&](const std::string& reason) {
        return Error(where, "BRDF file " + path.string() + ": " + reason);
    };
    if (numbers.empty() || !(numbers[0] >= 1) || numbers[0] != std::floor(numbers[0]) ||
        numbers[0] > float(numbers.size()))
        throw fail("it must start with the number of wavelengths");
    const size_t n = size_t(numbers[0]), record = 4 + n;
    if (numbers.size() < 1 + n + record || (numbers.size() - 1 - n) % record != 0)
        throw fail(std::to_string(numbers.size()) + " numbers do not make whole records of " +
                   std::to_string(record));
    const std::span<const float> wavelengths(&numbers[1], n);
    for (size_t i = 1; i < n; ++i)
        if (!(wavelengths[i] > wavelengths[i - 1]))
            throw fail("the wavelengths must ascend");
    std::vector<IrregularBrdf::Sample> samples;
    for (size_t i = 1 + n; i < numbers.size(); i += record) {
        const V3f wi = direction(numbers[i], numbers[i + 1]), wo = direction(numbers[i + 2], numbers[i + 3]);
        samples.push_back({IrregularBrdf::keyOf(wo, wi), spectrumToRgb(wavelengths, {&numbers[i + 4], n})});
    }
    return samples;
}

} // namespace strobe
