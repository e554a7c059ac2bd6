#include "core/pixel_sum.h"

#include "core/lanes.h"

namespace strobe {

namespace {

struct SmallSum {
    int64_t r, g, b;
    bool fits; ///< each is small enough for all of them to
};

STROBE_LANES SmallSum sumOf(const Rgb* values, const float* weights, int n, double perUnit) {
    constexpr double kMost = 0x1p63 / PixelSum::kTogether;
    int64_t red = 0, green = 0, blue = 0;
    int32_t large = 0;
    STROBE_INDEPENDENT
    for (int i = 0; i < n; ++i) {
        const double w = double(weights[i]) * perUnit;
        const double r = w * double(values[i].x), g = w * double(values[i].y), b = w * double(values[i].z);
        const bool isSmall = std::abs(r) + std::abs(g) + std::abs(b) < kMost; // no NaN either
        large |= !isSmall;
        red += int64_t(isSmall ? r : 0), green += int64_t(isSmall ? g : 0), blue += int64_t(isSmall ? b : 0);
    }
    return {red, green, blue, !large};
}

} // namespace

bool PixelSum::addTogether(const Rgb* values, const float* weights, int n) {
    const SmallSum sum = sumOf(values, weights, n, kPerUnit);
    if (!sum.fits)
        return false;
    m_r += sum.r, m_g += sum.g, m_b += sum.b;
    m_good += uint32_t(n);
    return true;
}

} // namespace strobe
