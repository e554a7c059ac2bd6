// Four floats in one vector register, for loads and stores of consecutive floats that the compiler would
// otherwise turn into gathers of single elements.
#pragma once

#include "core/math/soa.h"

#include <cstring>

namespace strobe {

/// Four floats.
typedef float Float4 __attribute__((vector_size(16)));

/// Returns the four floats that start at `source`, which need not be aligned.
STROBE_FORCE_INLINE Float4 loadFloat4(const float* source) {
    Float4 v;
    std::memcpy(&v, source, sizeof v);
    return v;
}
/// Writes `v` to the four floats that start at `target`, which need not be aligned.
STROBE_FORCE_INLINE void storeFloat4(float* target, const Float4& v) { std::memcpy(target, &v, sizeof v); }

/// Writes the first elements of a, b, c, d to x[0 … 3], their second elements to y[0 … 3], and their third
/// elements to z[0 … 3].
STROBE_FORCE_INLINE void storeTransposed(const Float4& a, const Float4& b, const Float4& c, const Float4& d,
                                         float* x, float* y, float* z) {
    const Float4 ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
    const Float4 cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    storeFloat4(x, __builtin_shufflevector(ab, cd, 0, 1, 4, 5));
    storeFloat4(y, __builtin_shufflevector(ab, cd, 2, 3, 6, 7));
    const Float4 abZ = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    const Float4 cdZ = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    storeFloat4(z, __builtin_shufflevector(abZ, cdZ, 0, 1, 4, 5));
}

} // namespace strobe
