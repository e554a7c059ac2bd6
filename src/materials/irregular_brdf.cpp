#include "materials/irregular_brdf.h"

#include "core/spectrum.h"

#include <array>
#include <charconv>
#include <fstream>
#include <numeric>
#include <sstream>

namespace strobe {
namespace {

constexpr int kCells = 20;

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

/// Squared distance from a point to the cell with the lower corner `lo` and side `side`.
float distance2(const V3f& p, const V3f& lo, float side) {
    float d2 = 0;
    for (int k = 0; k < 3; ++k)
        d2 += sqr(std::max({lo[k] - p[k], p[k] - lo[k] - side, 0.f}));
    return d2;
}

} // namespace

IrregularBrdf::IrregularBrdf(std::vector<Sample> samples) : m_samples(std::move(samples)) {
    m_all.resize(m_samples.size());
    std::iota(m_all.begin(), m_all.end(), 0u);
    buildCells();
}

V3f IrregularBrdf::keyOf(const V3f& wo, const V3f& wi) {
    const float sines = std::sqrt((wo.x * wo.x + wo.y * wo.y) * (wi.x * wi.x + wi.y * wi.y));
    const float dPhi = std::atan2(std::abs(wo.x * wi.y - wo.y * wi.x), wo.x * wi.x + wo.y * wi.y);
    return {std::min(sines, 1.f), std::min(dPhi * kInvPi, 1.f), wo.z * wi.z};
}

void IrregularBrdf::buildCells() {
    constexpr float kSide = 1.f / kCells, kSlack = 1e-5f; // for rounding, in eval and here
    const float halfDiagonal = kSide * std::sqrt(3.f) / 2 + kSlack;
    m_cells.resize(size_t(kCells) * kCells * kCells);
    for (size_t i = 0; i < m_cells.size(); ++i) {
        const V3f lo = V3f(float(i % kCells), float(i / kCells % kCells), float(i / kCells / kCells)) * kSide;
        if (lo.x + lo.z > 1 + kSide) // sin sin + cos cos <= 1: no pair of directions has such a key
            continue;
        Smallest3 nearest;
        for (const Sample& s : m_samples)
            nearest.add(length2(s.key - lo - V3f(kSide / 2)));
        // Anywhere in the cell the third nearest sample is at most this far.
        const float third = std::sqrt(nearest.c) + halfDiagonal;
        const float r = std::sqrt(searchRadius2(third * third)) + kSlack;
        m_cells[i].first = uint32_t(m_candidates.size());
        for (uint32_t k = 0; k < m_samples.size(); ++k)
            if (distance2(m_samples[k].key, lo, kSide) <= r * r)
                m_candidates.push_back(k);
        m_cells[i].count = uint32_t(m_candidates.size()) - m_cells[i].first;
    }
}

Rgb IrregularBrdf::mean(const V3f& key, const uint32_t* candidates, uint32_t n) const {
    Smallest3 nearest;
    for (uint32_t i = 0; i < n; ++i)
        nearest.add(length2(m_samples[candidates[i]].key - key));
    const float r2 = searchRadius2(nearest.c);
    // Weights relative to the nearest sample's: the same quotient, but it cannot become 0/0.
    Rgb sum(0);
    float weights = 0;
    for (uint32_t i = 0; i < n; ++i) {
        const Sample& s = m_samples[candidates[i]];
        const float d2 = length2(s.key - key);
        if (!(d2 < r2))
            continue;
        const float weight = std::exp(-100 * (d2 - nearest.a));
        sum += s.value * weight;
        weights += weight;
    }
    return sum / weights;
}

Rgb IrregularBrdf::eval(const V3f& key) const {
    const int x = std::min(int(key.x * kCells), kCells - 1), y = std::min(int(key.y * kCells), kCells - 1),
              z = std::min(int(key.z * kCells), kCells - 1);
    // Below the horizon (z < 0), and for what has no cell, every sample is a candidate.
    const Range cell = key.z < 0 ? Range{} : m_cells[size_t(x + kCells * (y + kCells * z))];
    return cell.count ? mean(key, &m_candidates[cell.first], cell.count) : evalBruteForce(key);
}

Rgb IrregularBrdf::evalBruteForce(const V3f& key) const {
    return mean(key, m_all.data(), uint32_t(m_all.size()));
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
