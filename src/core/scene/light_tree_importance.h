// The importance of the children of a light tree's node.
#pragma once

#include "core/scene/light_tree_nodes.h"

namespace strobe {

/// Writes the importance of the children of a node at a point: estimates of the irradiance of a surface there
/// (Conty Estevez and Kulla 2018, section 4.2; pbrt-v4, section 12.6.3). It is 0 only for children that
/// cannot illuminate the point. `fraction`: of the tree's interval. `isOriented`: see LightSubtree.
/// `motion` is read if the tree `isMoving`.
template <bool isOriented, bool isMoving>
STROBE_FORCE_INLINE void computeImportance(const LightNode& node, const LightNodeMotion* motion,
                                           float fraction, const LightPoint& point, float* importance) {
    constexpr float kRounding = 1e-4f; // of cosines
    constexpr float kMinCosine = .02f; // shading normals are not exact
    // The mean of a node's emitters is not at its bounds. These fractions of the radius were measured.
    constexpr float kEffectiveRadius = .5f, kIncidenceRadius = .65f;
    const V3f p = point.p, ng = point.ng, ns = point.ns;
    const float transmits = point.transmits ? 1.f : 0.f;
    STROBE_IVDEP
    for (int i = 0; i < LightNode::kWidth; ++i) {
        float cx = node.x[i] - p.x, cy = node.y[i] - p.y, cz = node.z[i] - p.z;
        if constexpr (isMoving) {
            cx += motion->x[i] * fraction;
            cy += motion->y[i] * fraction;
            cz += motion->z[i] * fraction;
        }
        const float d2 = std::max(cx * cx + cy * cy + cz * cz, 1e-20f), d = std::sqrt(d2);
        const float radius = std::abs(node.radius[i]), effective = kEffectiveRadius * radius;
        float emission = 1;
        if constexpr (isOriented) {
            // The angle θb that the sphere subtends; π inside.
            const float inv = 1 / d, sinRatio = radius * inv;
            const bool isInside = d2 <= radius * radius;
            const float sinB = isInside ? 0.f : sinRatio;
            const float cosB = isInside ? -1.f : std::sqrt(std::max(1 - sinRatio * sinRatio, 0.f));
            // The least angle between a normal and the direction to the point, as a cosine.
            const float cosAxis = -(cx * node.axisX[i] + cy * node.axisY[i] + cz * node.axisZ[i]) * inv;
            const float cosW = node.radius[i] < 0 ? std::abs(cosAxis) : cosAxis;
            const float sinW = std::sqrt(std::max(1 - cosW * cosW, 0.f));
            const bool isInCone = cosW >= node.cosSpread[i];
            const float cosO = isInCone ? 1.f : cosW * node.cosSpread[i] + sinW * node.sinSpread[i];
            const float sinO = isInCone ? 0.f : sinW * node.cosSpread[i] - cosW * node.sinSpread[i];
            const float cosE = cosO >= cosB ? 1.f : cosO * cosB + sinO * sinB;
            emission = cosE + kRounding > node.cosEmission[i] ? std::max(cosE, kRounding) : 0.f;
        }
        // Distances from the planes through the point, which are cosines times d.
        const float dN = cx * ns.x + cy * ns.y + cz * ns.z, dG = cx * ng.x + cy * ng.y + cz * ng.z;
        const float nearest = (transmits > 0 ? std::abs(dN) : dN) + kIncidenceRadius * radius;
        const bool isAbove = (transmits > 0) | (dG + radius > -kRounding * d);
        const float arriving = isAbove ? std::min(std::max(nearest, kMinCosine * d), d) : 0.f;
        const float irradiance =
            node.intensity[i] * emission * arriving / (d * std::max(d2, effective * effective));
        importance[i] = std::min(irradiance, 1e30f);
    }
}

} // namespace strobe
