// Elementary functions of float without tables or branches, so that the compiler vectorizes loops that call
// them. test/core/math/fast_math_test.cpp checks the stated errors.
#pragma once

#include "core/math/soa.h"

#include <bit>

namespace strobe {

/// Return sin x and cos x for |x| <= π/4, to float precision (truncated Taylor series).
STROBE_FORCE_INLINE float sinQuarter(float x) {
    const float x2 = x * x;
    return x * (1 - x2 * (1.f / 6 - x2 * (1.f / 120 - x2 * (1.f / 5040 - x2 * (1.f / 362880)))));
}
STROBE_FORCE_INLINE float cosQuarter(float x) {
    const float x2 = x * x;
    return 1 - x2 * (.5f - x2 * (1.f / 24 - x2 * (1.f / 720 - x2 * (1.f / 40320 - x2 * (1.f / 3628800)))));
}

/// Returns log2 x for normal, finite x > 0, with a relative error of at most 4e-7; the result is exact at
/// x = 1. Returns -127 for x = 0.
STROBE_FORCE_INLINE float fastLog2(float x) {
    constexpr int32_t kSqrtHalf = 0x3f3504f3; // x = m 2^k, m in [√½, √2)
    const int32_t bits = std::bit_cast<int32_t>(x);
    const int32_t k = (bits - kSqrtHalf) >> 23;
    const float m = std::bit_cast<float>(bits - k * (1 << 23));
    // ln m = 2 artanh((m-1)/(m+1)), truncated.
    const float s = (m - 1) / (m + 1);
    const float s2 = s * s;
    const float artanh = s * (1 + s2 * (1.f / 3 + s2 * (1.f / 5 + s2 * (1.f / 7 + s2 * (1.f / 9)))));
    return float(k) + artanh * 2.88539008f; // 2 / ln 2
}

/// Returns 2^x with a relative error of at most 2e-7 for -126 <= x < 127.5. The result falls to 0 below that
/// range and is infinite above it.
STROBE_FORCE_INLINE float fastExp2(float x) {
    const float clamped = std::min(std::max(x, -127.f), 128.f);
    const int32_t k = int32_t(clamped + 127.5f) - 127; // the nearest integer
    const float t = (clamped - float(k)) * 0.693147181f;
    const float power =
        1 +
        t * (1 + t * (1.f / 2 +
                      t * (1.f / 6 + t * (1.f / 24 + t * (1.f / 120 + t * (1.f / 720 + t * (1.f / 5040)))))));
    return power * std::bit_cast<float>((k + 127) * (1 << 23));
}

/// Returns x^y for x >= 0 and y > 0, with a relative error of at most 1e-6 (1 + |log2 x^y|).
STROBE_FORCE_INLINE float fastPow(float x, float y) { return fastExp2(y * fastLog2(x)); }

/// Returns e^x with a relative error of at most 3e-7 (1 + |x|).
STROBE_FORCE_INLINE float fastExp(float x) { return fastExp2(x * 1.44269504f); }

/// Returns the angle of (x, y) from the x axis, in [-π, π], with an absolute and a relative error of at most
/// 4e-7. Returns 0 for (0, 0).
STROBE_FORCE_INLINE float fastAtan2(float y, float x) {
    const float ax = std::abs(x), ay = std::abs(y);
    const float lesser = std::min(ax, ay), greater = std::max(ax, ay);
    // Above 22.5°, computes the angle from 45° instead: one division, and |r| <= tan 22.5°.
    const bool isWide = lesser > 0.414213562f * greater;
    const float r = (isWide ? lesser - greater : lesser) /
                    std::max(isWide ? lesser + greater : greater, std::numeric_limits<float>::min());
    // The minimax polynomial for |r| <= tan 22.5° (relative error 1.8e-8; found by the Remez exchange).
    const float r2 = r * r;
    const float arc =
        r * (1 + r2 * (-0.333327992f + r2 * (0.199744704f + r2 * (-0.138520883f + r2 * 0.0798673673f))));
    const float octant = isWide ? kPi / 4 + arc : arc;
    const float quadrant = ay > ax ? kPi / 2 - octant : octant;
    return std::copysign(x < 0 ? kPi - quadrant : quadrant, y);
}

/// The sine and the cosine of an angle.
struct SinCos {
    float sin, cos;
};
/// Returns the sine and cosine of 2π `turns`, |turns| < 2^20, each with an error of at most 2e-7.
STROBE_FORCE_INLINE SinCos sinCosOfTurns(float turns) {
    const int32_t quarters = int32_t(turns * 4 + (turns < 0 ? -.5f : .5f)); // the nearest integer
    const float x = (turns - float(quarters) * .25f) * (2 * kPi);
    const float s = sinQuarter(x), c = cosQuarter(x);
    const bool swapped = quarters & 1;
    const float sine = swapped ? c : s, cosine = swapped ? s : c;
    return {quarters & 2 ? -sine : sine, (quarters + 1) & 2 ? -cosine : cosine};
}

} // namespace strobe
