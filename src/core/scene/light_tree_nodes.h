// The nodes of a light tree and the importance of their children.
#pragma once

#include "core/math/soa.h"

#include <vector>

namespace strobe {

/// A shaded point, as the importance of lights depends on it. World space.
struct LightPoint {
    V3f p;
    V3f ng, ns;     ///< unit geometric and shading normal, on the side of the viewer
    bool transmits; ///< light from behind the surface counts, too
    float time;     ///< shutter fraction
};

/// A node of a light tree with up to eight children, as a structure of arrays: 48 bytes per child. The bounds
/// of a child are those of EmitterBounds. Unused slots have an intensity of 0.
struct alignas(64) LightNode {
    static constexpr int kWidth = 8;
    static constexpr uint32_t kLeaf = 1u << 31;  ///< marks a child that is a leaf
    float x[kWidth]{}, y[kWidth]{}, z[kWidth]{}; ///< center of the sphere at the begin of the tree's interval
    float radius[kWidth]{};                      ///< negative: the child emits on both sides
    float axisX[kWidth]{}, axisY[kWidth]{}, axisZ[kWidth]{};
    float cosSpread[kWidth]{}, sinSpread[kWidth]{};
    float cosEmission[kWidth]{};
    float intensity[kWidth]{};
    uint32_t child[kWidth]{}; ///< index of a node, or kLeaf and the index of a leaf
};

/// The motion of a node's children over the interval of the tree: 12 bytes per child.
struct LightNodeMotion {
    float x[LightNode::kWidth]{}, y[LightNode::kWidth]{}, z[LightNode::kWidth]{};
};

/// The tree of an interval of the shutter.
struct LightSubtree {
    std::vector<LightNode> nodes;         ///< the root is the first
    std::vector<LightNodeMotion> motions; ///< by node; empty: at rest
    std::vector<uint32_t> parents;        ///< by node: 8 times the parent's index plus the slot in it
    std::vector<uint32_t> leaves;         ///< by leaf: index of the emitter
    std::vector<uint32_t> slots;          ///< by emitter: 8 times the node's index plus the slot; or kNoSlot
    static constexpr uint32_t kNoSlot = ~0u; ///< the emitter is black, or not in the tree
};

/// Writes the importance of the children of a node at a point: bounds of the irradiance of a surface there
/// (Conty Estevez and Kulla 2018, section 4.2; pbrt-v4, section 12.6.3). It is 0 only for children that
/// cannot illuminate the point. `motion`: null if the tree is at rest. `fraction`: of the tree's interval.
STROBE_FORCE_INLINE void computeImportance(const LightNode& node, const LightNodeMotion* motion,
                                           float fraction, const LightPoint& point, float* importance) {
    constexpr float kRounding = 1e-4f; // of cosines
    constexpr float kMinCosine = .02f; // shading normals are not exact
    const V3f p = point.p, ng = point.ng, ns = point.ns;
    const float transmits = point.transmits ? 1.f : 0.f;
    float cx[LightNode::kWidth], cy[LightNode::kWidth], cz[LightNode::kWidth];
    for (int i = 0; i < LightNode::kWidth; ++i) {
        cx[i] = node.x[i] - p.x;
        cy[i] = node.y[i] - p.y;
        cz[i] = node.z[i] - p.z;
    }
    if (motion)
        for (int i = 0; i < LightNode::kWidth; ++i) {
            cx[i] += motion->x[i] * fraction;
            cy[i] += motion->y[i] * fraction;
            cz[i] += motion->z[i] * fraction;
        }
    STROBE_IVDEP
    for (int i = 0; i < LightNode::kWidth; ++i) {
        const float d2 = std::max(cx[i] * cx[i] + cy[i] * cy[i] + cz[i] * cz[i], 1e-30f);
        const float radius = std::abs(node.radius[i]), inv = 1 / std::sqrt(d2);
        // The angle θb that the sphere subtends; π inside.
        const bool isInside = d2 <= radius * radius;
        const float sinRatio = radius * inv;
        const float sinB = isInside ? 0.f : sinRatio;
        const float cosB = isInside ? -1.f : std::sqrt(std::max(1 - sinRatio * sinRatio, 0.f));
        // The least angle between a normal and the direction to the point, as a cosine.
        const float cosAxis = -(cx[i] * node.axisX[i] + cy[i] * node.axisY[i] + cz[i] * node.axisZ[i]) * inv;
        const float cosW = node.radius[i] < 0 ? std::abs(cosAxis) : cosAxis;
        const float sinW = std::sqrt(std::max(1 - cosW * cosW, 0.f));
        const bool isInCone = cosW >= node.cosSpread[i];
        const float cosO = isInCone ? 1.f : cosW * node.cosSpread[i] + sinW * node.sinSpread[i];
        const float sinO = isInCone ? 0.f : sinW * node.cosSpread[i] - cosW * node.sinSpread[i];
        const float cosE = cosO >= cosB ? 1.f : cosO * cosB + sinO * sinB;
        const float emission = cosE + kRounding > node.cosEmission[i] ? std::max(cosE, kRounding) : 0.f;
        // The least angle of incidence.
        const float cosN = (cx[i] * ns.x + cy[i] * ns.y + cz[i] * ns.z) * inv;
        const float cosI = transmits > 0 ? std::abs(cosN) : cosN;
        const float sinI = std::sqrt(std::max(1 - cosI * cosI, 0.f));
        const float incidence = cosI >= cosB ? 1.f : cosI * cosB + sinI * sinB;
        const float cosG = (cx[i] * ng.x + cy[i] * ng.y + cz[i] * ng.z) * inv;
        const bool isAbove = (transmits > 0) | isInside | (cosG + sinB > -kRounding);
        const float arriving = isAbove ? std::max(incidence, kMinCosine) : 0.f;
        importance[i] = node.intensity[i] * emission * arriving / std::max(d2, radius * radius);
    }
}

} // namespace strobe
