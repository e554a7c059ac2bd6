// What a pixel's samples add up to, exactly: in any order, in any grouping, on any machine, to the same bits.
#pragma once

#include "core/math/soa.h"

#include <bit>
#include <cstring>

namespace strobe {

/// Weighted values of samples, ready to be added to a PixelAccumulator: as the integers that it adds up.
struct FixedPointSamples {
    alignas(64) int64_t r[kSoAWidth], g[kSoAWidth], b[kSoAWidth];

    /// Those of n samples. False if some need to be added one by one: they are bad, or so large that the sum
    /// of kSoAWidth could overflow.
    bool set(const Rgb* values, const float* weights, int n);
};

/// Sums of weighted sample values as 128-bit integers. Each value is cut to a multiple of 2^-56 (far less
/// than a float's own error, of anything brighter than 1e-9), once, when it is added; after that nothing
/// rounds until `mean`. Sums of any split of a pixel's samples therefore add up to those of the whole.
class PixelAccumulator {
  public:
    /// Values must be smaller than this (of a weighted channel) to be added, ...
    static constexpr double kMaxValue = 0x1p48;
    /// ... and no more than these many samples of a pixel are: then nothing overflows.
    static constexpr uint32_t kMaxSamples = 1u << 23;
    /// Sums are in units of 1 / kPerUnit.
    static constexpr double kPerUnit = 0x1p56;

    /// A sample's value and its filter weight. False, and only counted as bad, if it is not a number or too
    /// large.
    bool add(const Rgb& value, float weight) {
        // In samplesFixed. Products of two floats are exact in a double; comparisons with a NaN are false.
        const double w = weight * kPerUnit, r = w * value.x, g = w * value.y, b = w * value.z;
        if (std::abs(r) + std::abs(g) + std::abs(b) < 0x1p63) [[likely]]
            m_r += int64_t(r), m_g += int64_t(g), m_b += int64_t(b);
        else if (fits(r) && fits(g) && fits(b))
            m_r += wide(r), m_g += wide(g), m_b += wide(b);
        else {
            ++m_bad;
            return false;
        }
        ++m_good;
        return true;
    }
    /// Members `first` to `first + n`, all of which must be ready.
    void add(const FixedPointSamples& samplesFixed, int first, int n) {
        int64_t r = 0, g = 0, b = 0;
        for (int i = first; i < first + n; ++i)
            r += samplesFixed.r[i], g += samplesFixed.g[i], b += samplesFixed.b[i];
        m_r += r, m_g += g, m_b += b;
        m_good += uint32_t(n);
    }
    void add(const PixelAccumulator& other) {
        m_r += other.m_r, m_g += other.m_g, m_b += other.m_b;
        m_good += other.m_good, m_bad += other.m_bad;
    }
    /// Over the samples that were added; black if there are none.
    Rgb mean() const {
        if (m_good == 0)
            return Rgb(0);
        const double scale = 1 / (kPerUnit * m_good);
        return {float(toDouble(m_r) * scale), float(toDouble(m_g) * scale), float(toDouble(m_b) * scale)};
    }
    uint32_t good() const { return m_good; }
    uint32_t bad() const { return m_bad; }
    bool operator==(const PixelAccumulator&) const = default;

    /// As bytes, for files.
    static constexpr size_t kBytes = 3 * 16 + 2 * 4;
    void store(char* bytes) const {
        std::memcpy(bytes, &m_r, 16), std::memcpy(bytes + 16, &m_g, 16), std::memcpy(bytes + 32, &m_b, 16);
        std::memcpy(bytes + 48, &m_good, 4), std::memcpy(bytes + 52, &m_bad, 4);
    }
    void load(const char* bytes) {
        static_assert(std::endian::native == std::endian::little);
        std::memcpy(&m_r, bytes, 16), std::memcpy(&m_g, bytes + 16, 16), std::memcpy(&m_b, bytes + 32, 16);
        std::memcpy(&m_good, bytes + 48, 4), std::memcpy(&m_bad, bytes + 52, 4);
    }

  private:
    using Sum = __int128;
    /// The nearest double. (Sums are small as a rule, and the processor converts 64 bits.)
    static double toDouble(Sum sum) {
        const int64_t small = int64_t(sum);
        return small == sum ? double(small) : double(sum);
    }
    static bool fits(double samplesFixed) { return std::abs(samplesFixed) < kMaxValue * kPerUnit; }
    /// Towards zero, as the conversion of small ones.
    static Sum wide(double samplesFixed) {
        const int64_t coarse = int64_t(samplesFixed * 0x1p-52); // what is left of a double's 53 bits is small
        return (Sum(coarse) << 52) + int64_t(samplesFixed - double(coarse) * 0x1p52);
    }

    Sum m_r = 0, m_g = 0, m_b = 0;
    uint32_t m_good = 0, m_bad = 0;
};

} // namespace strobe
