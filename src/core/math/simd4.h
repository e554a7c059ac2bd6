// Four numbers that are read or written at once, where a compiler makes many reads of a gather.
#pragma once

#include "core/math/soa.h"

#include <cstring>

namespace strobe {

typedef float Four __attribute__((vector_size(16)));

/// From any address.
STROBE_INLINE Four loadFour(const float* from) {
    Four v;
    std::memcpy(&v, from, sizeof v);
    return v;
}
STROBE_INLINE void storeFour(float* to, const Four& v) { std::memcpy(to, &v, sizeof v); }

/// What lanes `to`, `to + 1` and so on of three rows get from the first three numbers of a, b, c and d.
STROBE_INLINE void storeLanes(const Four& a, const Four& b, const Four& c, const Four& d, float* x, float* y,
                              float* z) {
    const Four ab = __builtin_shufflevector(a, b, 0, 4, 1, 5), cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    storeFour(x, __builtin_shufflevector(ab, cd, 0, 1, 4, 5));
    storeFour(y, __builtin_shufflevector(ab, cd, 2, 3, 6, 7));
    const Four abZ = __builtin_shufflevector(a, b, 2, 6, 3, 7),
               cdZ = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    storeFour(z, __builtin_shufflevector(abZ, cdZ, 0, 1, 4, 5));
}

} // namespace strobe
