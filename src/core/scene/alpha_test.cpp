#include "core/scene/alpha_test.h"

#include "core/interfaces/geometry.h"
#include "core/math/hash.h"

#include <cstring>

namespace strobe {

bool passesAlphaTest(const TriangleMesh& mesh, uint32_t seed, uint32_t prim, float u, float v, const V3f& o,
                     const V3f& d) {
    TextureQuery q;
    q.uv = triangleUv(mesh, prim, u, v);
    q.prim = prim;
    q.barycentrics = V2f(u, v);
    const float alpha = mesh.alpha.at(q);
    if (alpha >= 1)
        return true;
    uint32_t bits[6];
    std::memcpy(bits, &o.x, 12);
    std::memcpy(bits + 3, &d.x, 12);
    const uint64_t h = hashOf(seed, prim, bits[0], bits[1], bits[2], bits[3], bits[4], bits[5]);
    return !(alpha <= 0 || unitFloat(uint32_t(h >> 32)) >= alpha);
}

} // namespace strobe
