// How bright the samples of a pilot are.
#pragma once

#include "sharing/records/light_units.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace strobe {

/// Counts samples by the brightness of their direct and their indirect light: of the largest channel.
class Brightness {
  public:
    void add(const Rgb& direct, const Rgb& indirect) {
        ++m_samples;
        ++m_bins[int(LightPart::Direct)][binOf(maxComponent(direct))];
        ++m_bins[int(LightPart::Indirect)][binOf(maxComponent(indirect))];
    }
    void add(const Brightness& other) {
        m_samples += other.m_samples;
        for (int part = 0; part < kParts; ++part)
            for (size_t bin = 0; bin < m_bins[part].size(); ++bin)
                m_bins[part][bin] += other.m_bins[part][bin];
    }
    /// Returns the parts that are not black in all samples; both if all samples are black.
    LightParts litParts() const {
        LightParts out;
        for (const LightPart part : kAllParts)
            if (m_bins[int(part)][0] < m_samples)
                out.add(part);
        return out.isEmpty() ? LightParts::all() : out;
    }
    /// Returns limits far above those that this fraction of the samples of each part exceeds.
    RareLimits limits(double fraction) const {
        RareLimits out;
        for (int part = 0; part < kParts; ++part) {
            uint64_t left = std::max(uint64_t(fraction * double(m_samples)), uint64_t(1));
            size_t bin = m_bins[part].size() - 1;
            while (bin > 0 && m_bins[part][bin] <= left)
                left -= m_bins[part][bin--];
            if (bin > 0)
                out.of[part] = kMargin * upperEdge(bin);
        }
        return out;
    }

  private:
    static constexpr float kMargin = 3;
    static constexpr int kMantissaBits = 23, kBitsPerOctave = 3, kShift = kMantissaBits - kBitsPerOctave;
    static constexpr int kLeastExponent = -20, kLargestExponent = 40;
    static constexpr uint32_t kFirst = uint32_t(127 + kLeastExponent) << kBitsPerOctave,
                              kLast = uint32_t(127 + kLargestExponent) << kBitsPerOctave;

    /// Bin 0 has what is dark, negative or not a number.
    static size_t binOf(float brightness) {
        if (!(brightness > 0))
            return 0;
        return std::clamp(std::bit_cast<uint32_t>(brightness) >> kShift, kFirst, kLast) - kFirst;
    }
    static float upperEdge(size_t bin) {
        return std::bit_cast<float>((uint32_t(bin) + kFirst + 1) << kShift);
    }
    uint64_t m_samples = 0;
    std::array<uint32_t, kLast - kFirst + 1> m_bins[kParts] = {};
};

} // namespace strobe
