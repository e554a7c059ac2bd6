#include "materials/ggx.h"

#include "core/sampling.h"

namespace strobe {

bool GgxReflection::sample(const V3f& wo, const V2f& u, V3f& wi) const {
    // Dupuy & Benyoub, "Sampling Visible GGX Normals with Spherical Caps" (2023): where the ellipsoid is
    // stretched to a sphere, reflections are uniform over the cap z >= -stretched.z. In wo's plane, above.
    const V3f view(m_sinO, 0, std::abs(wo.z)), stretched = normalize(V3f(m_alpha.along * view.x, 0, view.z));
    const V3f h = uniformCone(u, 1 + std::min(stretched.z, 1.f)) + stretched;
    const V3f wh(m_alpha.along * h.x, m_alpha.across * h.y, std::max(h.z, 0.f));
    const float l2 = length2(wh);
    if (!(l2 > 1e-14f)) // against the view, along the horizon
        return false;
    const V3f w = normalize(wh * (2 * dot(view, wh) / l2) - view);
    wi = V3f(w.x * m_x.x - w.y * m_x.y, w.x * m_x.y + w.y * m_x.x, wo.z < 0 ? -w.z : w.z);
    return w.z > 0;
}

} // namespace strobe
