#include "core/interfaces/sampler.h"

#include "core/math/hash.h"

namespace strobe {

uint64_t pixelDomain(uint64_t seed, int x, int y) {
    constexpr int kEdgeBits = kPartBits / 2;
    uint64_t part = 0;
    for (int bit = 0; bit < kEdgeBits; ++bit)
        part |= uint64_t(x >> bit & 1) << 2 * bit | uint64_t(y >> bit & 1) << (2 * bit + 1);
    return hashOf(seed, x >> kEdgeBits, y >> kEdgeBits) << kPartBits | part;
}

void Sampler::fill1D(std::span<const SampleRange> ranges, uint32_t dim, float* out) const {
    for (const SampleRange& range : ranges) {
        fill1D(range, dim, out);
        out += range.n;
    }
}

void Sampler::fill2D(std::span<const SampleRange> ranges, uint32_t dim, V2SoA& out) const {
    V2f points[kSoAWidth];
    int count = 0;
    for (const SampleRange& range : ranges) {
        fill2D(range, dim, points);
        for (uint32_t i = 0; i < range.n; ++i)
            out.set(count++, points[i]);
    }
}

} // namespace strobe
