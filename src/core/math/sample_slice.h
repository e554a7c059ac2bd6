// Slices of the samples of pixels.
#pragma once

#include <cstdint>

namespace strobe {

/// A half-open interval of the sample numbers of a pixel.
struct SampleSlice {
    uint32_t first = 0, end = 0;
    uint32_t count() const { return end - first; }
    bool contains(uint32_t index) const { return first <= index && index < end; }
    bool operator==(const SampleSlice&) const = default;
};

} // namespace strobe
