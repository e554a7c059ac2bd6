// Float4 numbers that are read or written at once, where a compiler makes many reads of a gather.
#pragma once

#include "core/math/soa.h"

#include <cstring>

namespace strobe {

typedef float Float4 __attribute__((vector_size(16)));

/// From any address.
STROBE_FORCE_INLINE Float4 loadFloat4(const float* from) {
    Float4 v;
    std::memcpy(&v, from, sizeof v);
    return v;
}
STROBE_FORCE_INLINE void storeFloat4(float* to, const Float4& v) { std::memcpy(to, &v, sizeof v); }

/// What lanes `to`, `to + 1` and so on of three rows get from the first three numbers of a, b, c and d.
STROBE_FORCE_INLINE void storeTransposed(const Float4& a, const Float4& b, const Float4& c, const Float4& d,
                                         float* x, float* y, float* z) {
    const Float4 ab = __builtin_shufflevector(a, b, 0, 4, 1, 5),
                 cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    storeFloat4(x, __builtin_shufflevector(ab, cd, 0, 1, 4, 5));
    storeFloat4(y, __builtin_shufflevector(ab, cd, 2, 3, 6, 7));
    const Float4 abZ = __builtin_shufflevector(a, b, 2, 6, 3, 7),
                 cdZ = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    storeFloat4(z, __builtin_shufflevector(abZ, cdZ, 0, 1, 4, 5));
}

} // namespace strobe
