#include "core/film/pixel_accumulator.h"

namespace strobe {

namespace {

STROBE_TARGET_CLONES bool setQuanta(const Rgb* values, const float* weights, int n, FixedPointSamples& out) {
    constexpr double kMax = 0x1p63 / kSoAWidth;
    int64_t large = 0;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const double w = double(weights[i]) * PixelAccumulator::kPerUnit;
        const double r = w * double(values[i].x), g = w * double(values[i].y), b = w * double(values[i].z);
        const bool isSmall = std::abs(r) + std::abs(g) + std::abs(b) < kMax; // no NaN either
        large |= !isSmall;
        out.r[i] = int64_t(isSmall ? r : 0), out.g[i] = int64_t(isSmall ? g : 0),
        out.b[i] = int64_t(isSmall ? b : 0);
    }
    return !large;
}

} // namespace

bool FixedPointSamples::set(const Rgb* values, const float* weights, int n) {
    return setQuanta(values, weights, n, *this);
}

} // namespace strobe
