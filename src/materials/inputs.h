// Small helpers that materials share.
#pragma once

#include "core/interfaces/texture.h"

namespace strobe {

/// Negative values of textures count as black, as in pbrt.
inline Rgb nonNegative(const Rgb& c) { return {std::max(c.x, 0.f), std::max(c.y, 0.f), std::max(c.z, 0.f)}; }

/// An Rgb that may lie in Bsdf::data: Imath's own copies by code, so it is not trivially copyable.
struct PlainRgb {
    float x, y, z;
    PlainRgb(const Rgb& c) : x(c.x), y(c.y), z(c.z) {} // implicit, both ways
    operator Rgb() const { return {x, y, z}; }
    Rgb operator*(float s) const { return {x * s, y * s, z * s}; }
};

} // namespace strobe
