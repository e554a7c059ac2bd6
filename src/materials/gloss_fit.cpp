#include "materials/gloss_fit.h"

#include <array>
#include <vector>

namespace strobe {
namespace {

constexpr float kGreatestShare = .9f; ///< the rest keeps f |wi.z| / pdf bounded where the lobe is too narrow
constexpr int kShares = 4;
constexpr float kMinAlpha = .004f; ///< narrower lobes lose their shape to float's rounding
constexpr float kAlphaStep = .75f;
constexpr int kRounds = 2; ///< over the two roughnesses in turn
/// A lobe must save at least this part of the second moment, or there is none.
constexpr double kWorthwhile = .02;

/// A wi of the quadrature over the hemisphere.
struct Node {
    V3f wi;
    double square; ///< (f |wi.z|)² times the node's solid angle
};

/// Even in azimuth and in the square root of the half vector's polar angle, so that lobes of any width meet
/// many nodes. Half the azimuths do: f is isotropic.
std::vector<Node> quadrature(const GlossFit::Brdf& f, const V3f& wo) {
    constexpr int kPolar = 64, kAzimuth = 24;
    std::vector<Node> nodes;
    for (int i = 0; i < kPolar; ++i) {
        const float t = (float(i) + .5f) / kPolar, thetaH = kPi / 2 * sqr(t);
        const float width = kPi * t / kPolar, sinH = std::sin(thetaH);
        for (int j = 0; j < kAzimuth; ++j) {
            const float phi = kPi * (float(j) + .5f) / kAzimuth;
            const V3f wh(sinH * std::cos(phi), sinH * std::sin(phi), std::cos(thetaH));
            const float cosHalf = dot(wo, wh);
            const V3f wi = wh * (2 * cosHalf) - wo;
            if (cosHalf > 0 && wi.z > 0) // dwi = 4 wo·wh dwh
                nodes.push_back(
                    {wi, sqr(double(f(wo, wi) * wi.z)) * 4 * cosHalf * sinH * width * 2 * kPi / kAzimuth});
        }
    }
    return nodes;
}

/// A lobe, and the second moment of f |wi.z| / pdf by its mixture: the integral of (f |wi.z|)² / pdf.
struct Candidate {
    GlossFit::Lobe lobe;
    double moment;
};

/// Takes the best share for `alpha` if it is better than what `best` has.
void improve(Candidate& best, const std::vector<Node>& nodes, const V3f& wo, const GgxAlpha& alpha) {
    const GgxReflection lobe(wo, alpha);
    std::array<float, kShares> shares;
    for (size_t k = 0; k < kShares; ++k)
        shares[k] = kGreatestShare * float(k + 1) / kShares;
    std::array<double, kShares> moments{};
    for (const Node& node : nodes) {
        const float cosine = node.wi.z * kInvPi, density = lobe.pdf(wo, node.wi);
        for (size_t k = 0; k < kShares; ++k)
            moments[k] += node.square / lerp(cosine, density, shares[k]);
    }
    for (size_t k = 0; k < kShares; ++k)
        if (moments[k] < best.moment)
            best = {{shares[k], alpha}, moments[k]};
}

GlossFit::Lobe bestLobe(const GlossFit::Brdf& f, const V3f& wo) {
    const std::vector<Node> nodes = quadrature(f, wo);
    Candidate best{{0, {1, 1}}, kInfinity};
    for (float alpha = 1; alpha > kMinAlpha; alpha *= kAlphaStep)
        improve(best, nodes, wo, {alpha, alpha});
    for (int round = 0; round < kRounds; ++round) {
        for (float alpha = 1; alpha > kMinAlpha; alpha *= kAlphaStep)
            improve(best, nodes, wo, {best.lobe.alpha.along, alpha});
        for (float alpha = 1; alpha > kMinAlpha; alpha *= kAlphaStep)
            improve(best, nodes, wo, {alpha, best.lobe.alpha.across});
    }
    double withoutLobe = 0;
    for (const Node& node : nodes)
        withoutLobe += node.square / (node.wi.z * kInvPi);
    // Without a lobe the roughness still counts: `at` interpolates it.
    if (!(best.moment < (1 - kWorthwhile) * withoutLobe))
        best.lobe.share = 0;
    return best.lobe;
}

} // namespace

GlossFit::GlossFit(const Brdf& f) {
    for (int i = 0; i <= kSteps; ++i) {
        const float cosO = std::max(float(i) / kSteps, .01f); // nothing is seen from the horizon itself
        const Lobe lobe = bestLobe(f, V3f(safeSqrt(1 - cosO * cosO), 0, cosO));
        m_share[i] = lobe.share, m_along[i] = lobe.alpha.along, m_across[i] = lobe.alpha.across;
    }
}

} // namespace strobe
