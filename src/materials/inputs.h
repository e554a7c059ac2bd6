// Helpers that several materials share.
#pragma once

#include "core/interfaces/texture.h"

namespace strobe {

/// Returns `c` with negative channels set to zero: negative texture values are black, as in pbrt.
inline Rgb nonNegative(const Rgb& c) { return {std::max(c.x, 0.f), std::max(c.y, 0.f), std::max(c.z, 0.f)}; }

/// A trivially copyable Rgb for Bsdf::data; Imath's color type has a copy constructor of its own.
struct PlainRgb {
    float x, y, z;
    PlainRgb(const Rgb& c) : x(c.x), y(c.y), z(c.z) {} // NOLINT: implicit
    operator Rgb() const { return {x, y, z}; }         // NOLINT: implicit
    Rgb operator*(float s) const { return {x * s, y * s, z * s}; }
};

} // namespace strobe
