// Sums of numbers of a large range that do not depend on the order of the numbers.
#pragma once

#include "core/math/soa.h"

#include <cstdint>

namespace strobe {

/// A sum of numbers as a 128-bit integer, in units of 2^-40. Each number is truncated to a multiple of the
/// unit; numbers beyond ±2^60 count as ±2^60, and NaN as 0. All else is exact: sums of 2^23 numbers and more
/// do not overflow, and have the same bits for any order and grouping.
class FixedPointSum {
  public:
    static constexpr int kFractionBits = 40;
    static constexpr double kPerUnit = double(int64_t(1) << kFractionBits);

    FixedPointSum() = default;
    /// `units`: the number of units of 2^-40.
    explicit FixedPointSum(__int128 units) : m_units(Units(units)) {}
    __int128 units() const { return __int128(m_units); }

    void add(double value) {
        const double scaled = value * kPerUnit;
        if (std::abs(scaled) < 0x1p62) [[likely]]
            m_units += Units(__int128(int64_t(scaled)));
        else
            addLarge(scaled);
    }
    void add(const FixedPointSum& other) { m_units += other.m_units; }
    /// Returns the sum.
    double value() const {
        const __int128 sum = units();
        const int64_t low = int64_t(sum);
        return (low == sum ? double(low) : double(sum)) / kPerUnit; // 64 bits are converted faster
    }
    bool operator==(const FixedPointSum&) const = default;

  private:
    using Units = unsigned __int128; ///< overflow, as of damaged files, wraps

    void addLarge(double scaled) {
        constexpr double kMax = 0x1p60 * kPerUnit;
        if (scaled == scaled)
            m_units += Units(__int128(std::min(std::max(scaled, -kMax), kMax)));
    }

    Units m_units = 0;
};

/// A FixedPointSum for each channel of a color.
struct RgbSum {
    FixedPointSum channels[3];

    void add(const Rgb& color) {
        for (int c = 0; c < 3; ++c)
            channels[c].add(double(color[c]));
    }
    void add(const RgbSum& other) {
        for (int c = 0; c < 3; ++c)
            channels[c].add(other.channels[c]);
    }
    Rgb value() const {
        return {float(channels[0].value()), float(channels[1].value()), float(channels[2].value())};
    }
    bool operator==(const RgbSum&) const = default;
};

/// Adds integers. Overflow, as of damaged files, wraps.
inline void addWrapping(int64_t& sum, int64_t value) { sum = int64_t(uint64_t(sum) + uint64_t(value)); }

} // namespace strobe
