// Many numbers side by side, for loops that the compiler turns into vector instructions.
#pragma once

#include "core/math/math.h"

namespace strobe {

/// How many at most are side by side.
inline constexpr int kSoAWidth = 64;

/// A function so marked is compiled for several processors, and the program takes the one that suits when it
/// starts. (Multiplications and additions are never fused, so all give the same bits.) Mark a plain function
/// around a loop over lanes; what it calls must be inline.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && __GNUC__ >= 12 &&                      \
    !defined(__clang__) && !defined(__AVX2__) && !defined(__SANITIZE_ADDRESS__) &&                           \
    !defined(__SANITIZE_THREAD__)
#define STROBE_TARGET_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define STROBE_TARGET_CLONES
#endif

/// What such a loop calls, where the compiler finds it too long to inline.
#if defined(__GNUC__)
#define STROBE_FORCE_INLINE inline __attribute__((always_inline))
#else
#define STROBE_FORCE_INLINE inline
#endif

/// Before such a loop: no turn of it reads what another writes, whatever the pointers may say.
#if defined(__clang__)
#define STROBE_IVDEP _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define STROBE_IVDEP _Pragma("GCC ivdep")
#else
#define STROBE_IVDEP
#endif

struct alignas(64) V2SoA {
    float x[kSoAWidth], y[kSoAWidth];
    V2f at(int i) const { return {x[i], y[i]}; }
    void set(int i, const V2f& v) { x[i] = v.x, y[i] = v.y; }
};

struct alignas(64) V3SoA {
    float x[kSoAWidth], y[kSoAWidth], z[kSoAWidth];
    V3f at(int i) const { return {x[i], y[i], z[i]}; }
    void set(int i, const V3f& v) { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
};

struct alignas(64) RgbSoA {
    float r[kSoAWidth], g[kSoAWidth], b[kSoAWidth];
    Rgb at(int i) const { return {r[i], g[i], b[i]}; }
    void set(int i, const Rgb& c) { r[i] = c.x, g[i] = c.y, b[i] = c.z; }
};

} // namespace strobe
