#include "materials/irregular_brdf.h"

#include "core/fast_math.h"
#include "core/spectrum.h"

#include <charconv>
#include <fstream>
#include <numeric>
#include <span>
#include <sstream>
#include <string>

namespace strobe {
namespace {

/// Blocks per axis, of blocks within blocks; the last are the cells.
constexpr int kLevels[] = {4, 16}, kCells = 16;
constexpr uint32_t kMaxCandidates = 1024;
constexpr float kSlack = 1e-5f; ///< for rounding, of lookups and of the bounds here

/// r² of the search: the first of pbrt's radii that lies beyond three samples, given the squared distance of
/// the third nearest.
float searchRadius2(float third2) {
    for (float r2 = .001f; r2 < 1.5f; r2 *= 2)
        if (third2 < r2)
            return r2;
    return kInfinity;
}

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

/// A cube of key space.
struct IrregularBrdf::Block {
    V3f lo;
    float side;

    Block(size_t i, int perAxis)
        : lo(V3f(float(i % perAxis), float(i / perAxis % perAxis), float(i / perAxis / perAxis)) /
             float(perAxis)),
          side(1.f / float(perAxis)) {}
    /// False where sinθi sinθo + cosθi cosθo > 1: no pair of directions has such a key.
    bool isPossible() const { return lo.x + lo.z < 1 + kSlack; }
    float distance2(const V3f& p) const {
        float d2 = 0;
        for (int k = 0; k < 3; ++k)
            d2 += sqr(std::max({lo[k] - p[k], p[k] - lo[k] - side, 0.f}));
        return d2;
    }
};

IrregularBrdf::IrregularBrdf(std::vector<Sample> samples) : m_samples(std::move(samples)) { buildCells(); }

namespace {

STROBE_INLINE V3f keyOfPair(const V3f& wo, const V3f& wi) {
    const float sines = std::sqrt((wo.x * wo.x + wo.y * wo.y) * (wi.x * wi.x + wi.y * wi.y));
    const float dPhi = fastAtan2(std::abs(wo.x * wi.y - wo.y * wi.x), wo.x * wi.x + wo.y * wi.y);
    return {std::min(sines, 1.f), std::min(dPhi * kInvPi, 1.f), wo.z * wi.z};
}

STROBE_LANES void keysOfPairs(const V3Lanes& wo, const V3Lanes& wi, int begin, int end, V3Lanes& keys) {
    STROBE_INDEPENDENT
    for (int i = begin; i < end; ++i) {
        const V3f key = keyOfPair(wo.at(i), wi.at(i));
        keys.x[i] = key.x, keys.y[i] = key.y, keys.z[i] = key.z;
    }
}

} // namespace

V3f IrregularBrdf::keyOf(const V3f& wo, const V3f& wi) { return keyOfPair(wo, wi); }

void IrregularBrdf::keyLanes(const V3Lanes& wo, const V3Lanes& wi, int begin, int end, V3Lanes& keys) {
    keysOfPairs(wo, wi, begin, end, keys);
}

/// Those of `candidates` that a point of the block may need, and the least squared radius its points search.
std::vector<uint32_t> IrregularBrdf::needed(const Block& block, const std::vector<uint32_t>& candidates,
                                            float& r2) const {
    const V3f centre = block.lo + V3f(block.side / 2);
    const float halfDiagonal = block.side * std::sqrt(3.f) / 2 + kSlack;
    Smallest3 nearest;
    for (const uint32_t k : candidates)
        nearest.add(length2(m_samples[k].key - centre));
    // The distance of the third nearest sample changes no faster than the point moves.
    const float third = std::sqrt(nearest.c);
    r2 = searchRadius2(sqr(std::max(0.f, third - halfDiagonal)));
    const float r = std::sqrt(searchRadius2(sqr(third + halfDiagonal))) + kSlack;
    std::vector<uint32_t> result;
    for (const uint32_t k : candidates)
        if (block.distance2(m_samples[k].key) <= r * r)
            result.push_back(k);
    return result;
}

void IrregularBrdf::buildCells() {
    std::vector<uint32_t> all(m_samples.size());
    std::iota(all.begin(), all.end(), 0u);
    std::vector<std::vector<uint32_t>> outer{all}, inner;
    int outerCount = 1;
    m_cells.resize(size_t(kCells) * kCells * kCells);
    for (const int count : kLevels) {
        inner.assign(size_t(count) * size_t(count) * size_t(count), {});
        for (size_t i = 0; i < inner.size(); ++i) {
            const Block block(i, count);
            if (!block.isPossible())
                continue;
            const size_t n = size_t(count), from = size_t(outerCount), x = i % n * from / n,
                         y = i / n % n * from / n, z = i / n / n * from / n;
            float r2;
            inner[i] = needed(block, outer[x + from * (y + from * z)], r2);
            if (count == kCells)
                m_cells[i].r2 = r2, addCell(m_cells[i], inner[i]);
        }
        outer.swap(inner);
        outerCount = count;
    }
}

void IrregularBrdf::addCell(Cell& cell, const std::vector<uint32_t>& list) {
    // A cell of very many samples, or of distant ones only, is left empty: it looks at all of them.
    if (list.size() > kMaxCandidates || cell.r2 == kInfinity)
        return;
    cell.first = uint32_t(m_groups.size());
    cell.count = uint32_t((list.size() + Group::kSize - 1) / Group::kSize);
    const Sample far{V3f(100), Rgb(0)}; // beyond all radii
    for (uint32_t i = 0; i < cell.count * Group::kSize; ++i) {
        const int k = int(i % Group::kSize);
        if (k == 0)
            m_groups.emplace_back();
        const Sample& s = i < list.size() ? m_samples[list[i]] : far;
        Group& group = m_groups.back();
        group.x[k] = s.key.x, group.y[k] = s.key.y, group.z[k] = s.key.z;
        group.r[k] = s.value.x, group.g[k] = s.value.y, group.b[k] = s.value.z;
    }
}

/// What a lookup reads.
struct IrregularBrdf::Grid {
    const Cell* cells;
    const Group* groups;

    /// False where all samples are to be looked at.
    STROBE_INLINE bool mean(const V3f& key, Rgb& out) const {
        constexpr int kSize = Group::kSize;
        if (!(key.z >= 0)) // through the horizon: outside the grid
            return false;
        const int ix = std::min(int(key.x * kCells), kCells - 1),
                  iy = std::min(int(key.y * kCells), kCells - 1),
                  iz = std::min(int(key.z * kCells), kCells - 1);
        const Cell cell = cells[ix + kCells * (iy + kCells * iz)];
        if (cell.count == 0)
            return false;
        const Group* of = groups + cell.first;
        const float kx = key.x, ky = key.y, kz = key.z;
        alignas(64) float d2[kMaxCandidates];
        for (uint32_t i = 0; i < cell.count; ++i)
            for (int k = 0; k < kSize; ++k)
                d2[i * kSize + k] = sqr(of[i].x[k] - kx) + sqr(of[i].y[k] - ky) + sqr(of[i].z[k] - kz);
        float r2 = cell.r2 / 2;
        for (int32_t found = 0; found <= 2;) {
            r2 *= 2;
            if (r2 > 1.5f)
                return false;
            found = 0;
            for (uint32_t i = 0; i < cell.count * kSize; ++i)
                found += d2[i] < r2;
        }
        // Sums of rows: floats are not added in another order than is written. Weights are relative to that
        // at d² = r²/2: the same quotient, but it can be neither 0/0 nor infinite.
        alignas(64) float w[kSize] = {}, red[kSize] = {}, green[kSize] = {}, blue[kSize] = {};
        for (uint32_t i = 0; i < cell.count; ++i)
            for (int k = 0; k < kSize; ++k) {
                const float d = d2[i * kSize + k], near = fastExp(100 * (r2 / 2 - d)),
                            weight = d < r2 ? near : 0;
                w[k] += weight;
                red[k] += of[i].r[k] * weight, green[k] += of[i].g[k] * weight;
                blue[k] += of[i].b[k] * weight;
            }
        for (int half = kSize / 2; half > 0; half /= 2)
            for (int k = 0; k < half; ++k) {
                w[k] += w[k + half];
                red[k] += red[k + half], green[k] += green[k + half], blue[k] += blue[k + half];
            }
        const float scale = 1 / w[0];
        out = Rgb(red[0] * scale, green[0] * scale, blue[0] * scale);
        return true;
    }

    /// missing[0 … ] of the result: where all samples are to be looked at.
    static int meanLanes(const Grid& grid, const V3Lanes& keys, const int32_t* wanted, int begin, int end,
                         RgbLanes& out, int32_t* missing);
};

STROBE_LANES int IrregularBrdf::Grid::meanLanes(const Grid& grid, const V3Lanes& keys, const int32_t* wanted,
                                                int begin, int end, RgbLanes& out, int32_t* missing) {
    int count = 0;
    for (int i = begin; i < end; ++i) {
        Rgb mean(0);
        if ((!wanted || wanted[i]) && !grid.mean(keys.at(i), mean))
            missing[count++] = i;
        out.set(i, mean);
    }
    return count;
}

Rgb IrregularBrdf::eval(const V3f& key) const {
    Rgb mean;
    return Grid{m_cells.data(), m_groups.data()}.mean(key, mean) ? mean : evalBruteForce(key);
}

void IrregularBrdf::evalLanes(const V3Lanes& keys, const int32_t* wanted, int begin, int end,
                              RgbLanes& out) const {
    int32_t missing[kLanes];
    const Grid grid{m_cells.data(), m_groups.data()};
    const int count = Grid::meanLanes(grid, keys, wanted, begin, end, out, missing);
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
