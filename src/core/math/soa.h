// Structures of arrays (SoA), for loops that the compiler vectorizes.
#pragma once

#include "core/math/math.h"

namespace strobe {

/// The capacity of an SoA: the maximum number of elements that one call processes.
inline constexpr int kSoAWidth = 64;

/// Compiles a function for several x86-64 levels; the dynamic linker selects one for the processor when the
/// program starts. Multiplications and additions are never fused, so all versions return the same bits. For
/// free and static functions that consist of a loop over an SoA; every function that the loop calls must be
/// inline.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && __GNUC__ >= 12 &&                      \
    !defined(__clang__) && !defined(__AVX2__) && !defined(__SANITIZE_ADDRESS__) &&                           \
    !defined(__SANITIZE_THREAD__)
#define STROBE_TARGET_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define STROBE_TARGET_CLONES
#endif

/// For functions called in such a loop that the compiler considers too long to inline.
#if defined(__GNUC__)
#define STROBE_FORCE_INLINE inline __attribute__((always_inline))
#else
#define STROBE_FORCE_INLINE inline
#endif

/// Precedes such a loop. Asserts that no iteration reads a value that another iteration writes, so that the
/// compiler need not prove that the arrays do not alias.
#if defined(__clang__)
#define STROBE_IVDEP _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define STROBE_IVDEP _Pragma("GCC ivdep")
#else
#define STROBE_IVDEP
#endif

/// Two-component vectors as a structure of arrays.
struct alignas(64) V2SoA {
    float x[kSoAWidth], y[kSoAWidth];
    V2f at(int i) const { return {x[i], y[i]}; }
    void set(int i, const V2f& v) {
        x[i] = v.x;
        y[i] = v.y;
    }
};

/// Three-component vectors as a structure of arrays.
struct alignas(64) V3SoA {
    float x[kSoAWidth], y[kSoAWidth], z[kSoAWidth];
    V3f at(int i) const { return {x[i], y[i], z[i]}; }
    void set(int i, const V3f& v) {
        x[i] = v.x;
        y[i] = v.y;
        z[i] = v.z;
    }
};

/// Linear RGB colors as a structure of arrays.
struct alignas(64) RgbSoA {
    float r[kSoAWidth], g[kSoAWidth], b[kSoAWidth];
    Rgb at(int i) const { return {r[i], g[i], b[i]}; }
    void set(int i, const Rgb& c) {
        r[i] = c.x;
        g[i] = c.y;
        b[i] = c.z;
    }
};

} // namespace strobe
