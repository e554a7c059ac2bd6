// Exact sums of a pixel's samples: the result has the same bits for any order and grouping, on any machine.
#pragma once

#include "core/math/api.h"
#include "core/math/soa.h"

#include <bit>
#include <cstring>

namespace STROBE_API strobe {

/// Weighted sample values as fixed-point numbers, in units of 1 / PixelAccumulator::kPerUnit.
struct FixedPointSamples {
    alignas(64) int64_t r[kSoAWidth], g[kSoAWidth], b[kSoAWidth];
    alignas(64) uint32_t isNegative[kSoAWidth]; ///< whether the weight is: 0 or 1
    bool anyIsNegative;

    /// Converts n <= kSoAWidth samples with weights of 1 or -1. Returns false if any of them must be added by
    /// itself, because it is invalid or so large that a sum of kSoAWidth such values could overflow.
    bool set(const Rgb* values, const float* weights, int n);
};

/// The sum of a pixel's weighted samples per channel, as 128-bit fixed-point numbers, and the sum of their
/// weights, 1 or -1. Adding a sample truncates its value to a multiple of 2^-56, which is less than half an
/// ulp of any float above 1e-9. All sums after that are exact; only `mean` rounds again. The sums of any
/// partition of a pixel's samples therefore add up to the sum of all samples, to the bit.
class PixelAccumulator {
  public:
    /// A sample is valid if each of its weighted channels has a smaller absolute value than this.
    static constexpr double kMaxValue = 0x1p48;
    /// The maximum number of samples of a pixel: sums of as many valid samples cannot overflow.
    static constexpr uint32_t kMaxSamples = 1u << 23;
    /// Sums are in units of 1 / kPerUnit.
    static constexpr double kPerUnit = 0x1p56;

    /// Adds a sample, given its value and its filter weight, 1 or -1. Returns false if it is invalid, that is
    /// NaN, infinite or too large; it is then counted, but not added.
    bool add(const Rgb& value, float weight) {
        // The product of two floats is exact in a double, and a power of two keeps it so. Comparisons with a
        // NaN are false.
        const double w = weight * kPerUnit, r = w * value.x, g = w * value.y, b = w * value.z;
        if (std::abs(r) + std::abs(g) + std::abs(b) < 0x1p63) [[likely]] {
            m_r += int64_t(r);
            m_g += int64_t(g);
            m_b += int64_t(b);
        } else if (isValid(r) && isValid(g) && isValid(b)) {
            m_r += toFixedPoint(r);
            m_g += toFixedPoint(g);
            m_b += toFixedPoint(b);
        } else {
            ++m_invalidCount;
            return false;
        }
        ++m_validCount;
        m_negativeCount += weight < 0;
        return true;
    }
    /// Adds samples first … first+n-1. Precondition: `set` returned true for them.
    void add(const FixedPointSamples& samples, int first, int n) {
        int64_t r = 0, g = 0, b = 0;
        for (int i = first; i < first + n; ++i) {
            r += samples.r[i];
            g += samples.g[i];
            b += samples.b[i];
        }
        m_r += r;
        m_g += g;
        m_b += b;
        m_validCount += uint32_t(n);
        if (samples.anyIsNegative)
            for (int i = first; i < first + n; ++i)
                m_negativeCount += samples.isNegative[i];
    }
    /// Adds the samples of another accumulator.
    void add(const PixelAccumulator& other) {
        m_r += other.m_r;
        m_g += other.m_g;
        m_b += other.m_b;
        m_validCount += other.m_validCount;
        m_negativeCount += other.m_negativeCount;
        m_invalidCount += other.m_invalidCount;
    }
    /// Returns the sum divided by that of the weights; black if the latter is 0.
    Rgb mean() const {
        if (weight() == 0)
            return Rgb(0);
        const double scale = 1 / (kPerUnit * double(weight()));
        return {float(toDouble(m_r) * scale), float(toDouble(m_g) * scale), float(toDouble(m_b) * scale)};
    }
    /// The sum of the weights of the samples that were added.
    int64_t weight() const { return int64_t(m_validCount) - 2 * int64_t(m_negativeCount); }
    /// The number of samples that were added.
    uint32_t validCount() const { return m_validCount; }
    /// The number of samples that were left out because they are invalid.
    uint32_t invalidCount() const { return m_invalidCount; }
    bool operator==(const PixelAccumulator&) const = default;

    /// The size of the representation in files.
    static constexpr size_t kBytes = 3 * 16 + 3 * 4;
    void store(char* bytes) const {
        std::memcpy(bytes, &m_r, 16);
        std::memcpy(bytes + 16, &m_g, 16);
        std::memcpy(bytes + 32, &m_b, 16);
        std::memcpy(bytes + 48, &m_validCount, 4);
        std::memcpy(bytes + 52, &m_invalidCount, 4);
        std::memcpy(bytes + 56, &m_negativeCount, 4);
    }
    void load(const char* bytes) {
        static_assert(std::endian::native == std::endian::little);
        std::memcpy(&m_r, bytes, 16);
        std::memcpy(&m_g, bytes + 16, 16);
        std::memcpy(&m_b, bytes + 32, 16);
        std::memcpy(&m_validCount, bytes + 48, 4);
        std::memcpy(&m_invalidCount, bytes + 52, 4);
        std::memcpy(&m_negativeCount, bytes + 56, 4);
    }

  private:
    using Sum = __int128;
    /// Returns the nearest double. Most sums fit into 64 bits, which the processor converts directly.
    static double toDouble(Sum sum) {
        const int64_t low = int64_t(sum);
        return low == sum ? double(low) : double(sum);
    }
    static bool isValid(double scaled) { return std::abs(scaled) < kMaxValue * kPerUnit; }
    /// Returns a valid value, already multiplied by kPerUnit, truncated towards zero.
    static Sum toFixedPoint(double scaled) {
        const int64_t high = int64_t(scaled * 0x1p-52); // the remainder fits into 64 bits
        return (Sum(high) << 52) + int64_t(scaled - double(high) * 0x1p52);
    }

    Sum m_r = 0, m_g = 0, m_b = 0;
    uint32_t m_validCount = 0, m_invalidCount = 0;
    uint32_t m_negativeCount = 0; ///< of the valid ones: those with negative weights
};

} // namespace strobe
