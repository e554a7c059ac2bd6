#include "core/math/equal_area.h"

namespace strobe {

V2f equalAreaPoint(const V3f& w) {
    const float x = std::abs(w.x), y = std::abs(w.y), z = std::abs(w.z);
    // A spherical cap around the pole maps to a square around the center of the same relative area.
    const float r = std::sqrt(std::max(1 - z, 0.f)), phi = x + y > 0 ? std::atan2(y, x) * (2 / kPi) : 0;
    float u = r * (1 - phi), v = r * phi; // phi: in quarter turns
    if (w.z < 0) {                        // the lower hemisphere is folded outwards over the diagonal
        const float unfolded = u;
        u = 1 - v;
        v = 1 - unfolded;
    }
    return {(std::copysign(u, w.x) + 1) / 2, (std::copysign(v, w.y) + 1) / 2};
}

V3f equalAreaDirection(V2f p) {
    if (p.x < 0 || p.x > 1)
        p = V2f(p.x < 0 ? -p.x : 2 - p.x, 1 - p.y);
    if (p.y < 0 || p.y > 1)
        p = V2f(1 - p.x, p.y < 0 ? -p.y : 2 - p.y);
    const float x = 2 * p.x - 1, y = 2 * p.y - 1, u = std::abs(x), v = std::abs(y);
    const float above = 1 - (u + v), r = 1 - std::abs(above); // above: the distance from the equator
    const float phi = (r > 0 ? (v - u) / r + 1 : 1) * (kPi / 4), ring = r * safeSqrt(2 - r * r);
    return {std::copysign(ring * std::cos(phi), x), std::copysign(ring * std::sin(phi), y),
            std::copysign(1 - r * r, above)};
}

} // namespace strobe
