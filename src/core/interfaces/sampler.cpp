#include "core/interfaces/sampler.h"

namespace strobe {

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
