#include "core/film/pixel_accumulator.h"

namespace strobe {

namespace {

STROBE_TARGET_CLONES bool convertSamples(const Rgb* values, const float* weights, int n,
                                         FixedPointSamples& out) {
    constexpr double kMax = 0x1p63 / kSoAWidth;
    int64_t anyTooLarge = 0;
    uint32_t anyIsNegative = 0;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const double w = double(weights[i]) * PixelAccumulator::kPerUnit;
        const double r = w * double(values[i].x), g = w * double(values[i].y), b = w * double(values[i].z);
        const bool fits = std::abs(r) + std::abs(g) + std::abs(b) < kMax; // false for NaN
        anyTooLarge |= !fits;
        out.isNegative[i] = weights[i] < 0 ? 1 : 0;
        anyIsNegative |= out.isNegative[i];
        out.r[i] = int64_t(fits ? r : 0);
        out.g[i] = int64_t(fits ? g : 0);
        out.b[i] = int64_t(fits ? b : 0);
    }
    out.anyIsNegative = anyIsNegative;
    return !anyTooLarge;
}

} // namespace

bool FixedPointSamples::set(const Rgb* values, const float* weights, int n) {
    return convertSamples(values, weights, n, *this);
}

} // namespace strobe
