#include "materials/ggx.h"

#include "core/sampling.h"

namespace strobe {

bool GgxReflection::sample(const V3f& wo, const V2f& u, V3f& wi) const {
    // Dupuy & Benyoub, "Sampling Visible GGX Normals with Spherical Caps" (2023): where the ellipsoid is
    // stretched to a sphere, reflections are uniform over the cap z >= -stretched.z.
    const float side = wo.z < 0 ? -1.f : 1.f;
    const V3f view = wo * side, stretched = normalize(V3f(m_alpha * view.x, m_alpha * view.y, view.z));
    const V3f h = uniformCone(u, 1 + std::min(stretched.z, 1.f)) + stretched;
    const V3f wh(m_alpha * h.x, m_alpha * h.y, std::max(h.z, 0.f));
    const float l2 = length2(wh);
    if (!(l2 > 1e-14f)) // against the view, along the horizon
        return false;
    const V3f reflected = normalize(wh * (2 * dot(view, wh) / l2) - view);
    wi = reflected * side;
    return reflected.z > 0;
}

} // namespace strobe
