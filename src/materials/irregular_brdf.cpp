#include "materials/irregular_brdf.h"

#include "core/spectrum.h"

#include <charconv>
#include <fstream>
#include <numeric>
#include <span>
#include <sstream>
#include <string>

namespace strobe {
namespace {

constexpr int kCells = 16, kCoarse = 4; ///< per axis; a coarse block holds (kCells/kCoarse)³ cells
constexpr uint32_t kMaxCandidates = 512;
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

V3f IrregularBrdf::keyOf(const V3f& wo, const V3f& wi) {
    const float sines = std::sqrt((wo.x * wo.x + wo.y * wo.y) * (wi.x * wi.x + wi.y * wi.y));
    const float dPhi = std::atan2(std::abs(wo.x * wi.y - wo.y * wi.x), wo.x * wi.x + wo.y * wi.y);
    return {std::min(sines, 1.f), std::min(dPhi * kInvPi, 1.f), wo.z * wi.z};
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
    m_cells.resize(size_t(kCells) * kCells * kCells);
    std::vector<uint32_t> all(m_samples.size());
    std::iota(all.begin(), all.end(), 0u);
    std::vector<std::vector<uint32_t>> coarse(size_t(kCoarse) * kCoarse * kCoarse);
    float unused;
    for (size_t i = 0; i < coarse.size(); ++i)
        if (const Block block(i, kCoarse); block.isPossible())
            coarse[i] = needed(block, all, unused);
    constexpr size_t kRatio = kCells / kCoarse;
    static_assert(kRatio * kCoarse == kCells);
    for (size_t i = 0; i < m_cells.size(); ++i) {
        const Block block(i, kCells);
        const size_t x = i % kCells / kRatio, y = i / kCells % kCells / kRatio,
                     z = i / kCells / kCells / kRatio;
        if (!block.isPossible())
            continue;
        const std::vector<uint32_t> list =
            needed(block, coarse[x + kCoarse * (y + kCoarse * z)], m_cells[i].r2);
        // A cell of very many samples, or of distant ones only, is left empty: it looks at all of them.
        if (list.size() > kMaxCandidates || m_cells[i].r2 == kInfinity)
            continue;
        m_cells[i].first = uint32_t(m_index.size());
        for (const uint32_t k : list) {
            const V3f& key = m_samples[k].key;
            m_x.push_back(key.x), m_y.push_back(key.y), m_z.push_back(key.z);
            m_index.push_back(k);
        }
        for (; m_index.size() % kGroup != 0; m_index.push_back(0))
            m_x.push_back(100), m_y.push_back(100), m_z.push_back(100); // beyond all radii
        m_cells[i].groups = (uint32_t(m_index.size()) - m_cells[i].first) / kGroup;
    }
}

Rgb IrregularBrdf::eval(const V3f& key) const {
    if (key.z < 0) // through the horizon: outside the grid
        return evalBruteForce(key);
    const int x = std::min(int(key.x * kCells), kCells - 1), y = std::min(int(key.y * kCells), kCells - 1),
              z = std::min(int(key.z * kCells), kCells - 1);
    const Cell cell = m_cells[size_t(x + kCells * (y + kCells * z))];
    if (cell.groups == 0)
        return evalBruteForce(key);
    const uint32_t n = cell.groups * kGroup;
    const float *xs = &m_x[cell.first], *ys = &m_y[cell.first], *zs = &m_z[cell.first];
    alignas(32) float d2[kMaxCandidates + kGroup];
    for (uint32_t i = 0; i < n; ++i)
        d2[i] = sqr(xs[i] - key.x) + sqr(ys[i] - key.y) + sqr(zs[i] - key.z);
    float r2 = cell.r2 / 2;
    for (int found = 0; found <= 2;) {
        r2 *= 2;
        if (r2 > 1.5f)
            return evalBruteForce(key);
        found = 0;
        for (uint32_t i = 0; i < n; ++i)
            found += d2[i] < r2;
    }
    uint32_t chosen[kMaxCandidates + kGroup], count = 0;
    for (uint32_t i = 0; i < n; ++i) { // collects without branches
        chosen[count] = i;
        count += d2[i] < r2;
    }
    // Weights relative to that at d² = r²/2: the same quotient, but it can be neither 0/0 nor infinite.
    Rgb sum(0);
    float weights = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const float weight = std::exp(-100 * (d2[chosen[i]] - r2 / 2));
        sum += m_samples[m_index[cell.first + chosen[i]]].value * weight;
        weights += weight;
    }
    return sum / weights;
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
