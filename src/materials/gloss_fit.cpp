#include "materials/gloss_fit.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <vector>

namespace strobe {
namespace {

/// The largest probability of the lobe. The cosine gets the rest, which bounds f |wi.z| / pdf where the lobe
/// is too narrow.
constexpr float kMaxProbability = .9f;
constexpr int kProbabilities = 4;  ///< number of probabilities tried, up to kMaxProbability
constexpr float kMinAlpha = .004f; ///< narrower lobes lose their shape to rounding in float
constexpr float kAlphaStep = .75f; ///< ratio of successive roughnesses tried
constexpr int kRounds = 2;         ///< of improving the two roughnesses in turn
/// A lobe that reduces the second moment by less than this fraction is dropped.
constexpr double kMinGain = .02;

/// A node of the quadrature over the hemisphere of wi.
struct Node {
    V3f wi;
    double light;  ///< f |wi.z| times the solid angle of the node
    double square; ///< (f |wi.z|)² times the solid angle of the node
};

/// Returns nodes that are equidistant in azimuth and in the square root of the polar angle of the half
/// vector, so that lobes of any width cover many nodes. The azimuths span 180°, because f is isotropic.
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
            if (!(cosHalf > 0 && wi.z > 0))
                continue;
            const double value = double(f(wo, wi) * wi.z);
            const auto times = [&](double x) { // the solid angle: dwi = 4 wo·wh dwh
                return x * 4 * cosHalf * sinH * width * 2 * kPi / kAzimuth;
            };
            nodes.push_back({wi, times(value), times(sqr(value))});
        }
    }
    return nodes;
}

/// A lobe and the second moment of f |wi.z| / pdf for its mixture: the integral of (f |wi.z|)² / pdf.
struct Candidate {
    GlossFit::Lobe lobe;
    double moment;
};

/// Replaces `best` by the best probability for `alpha` if that lowers the second moment.
void improve(Candidate& best, const std::vector<Node>& nodes, const V3f& wo, const GgxAlpha& alpha) {
    const GgxReflection lobe(wo, alpha);
    std::array<float, kProbabilities> probabilities;
    for (size_t k = 0; k < kProbabilities; ++k)
        probabilities[k] = kMaxProbability * float(k + 1) / kProbabilities;
    std::array<double, kProbabilities> moments{};
    for (const Node& node : nodes) {
        const float cosine = node.wi.z * kInvPi, density = lobe.pdf(wo, node.wi);
        for (size_t k = 0; k < kProbabilities; ++k)
            moments[k] += node.square / lerp(cosine, density, probabilities[k]);
    }
    for (size_t k = 0; k < kProbabilities; ++k)
        if (moments[k] < best.moment)
            best = {{probabilities[k], alpha}, moments[k]};
}

/// Returns the lobe of least variance for `wo`: the best isotropic lobe, refined in each roughness in turn.
GlossFit::Lobe bestLobe(const std::vector<Node>& nodes, const V3f& wo) {
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
    // The roughness is kept even if the probability is 0: GlossFit::at interpolates it.
    if (!(best.moment < (1 - kMinGain) * withoutLobe))
        best.lobe.probability = 0;
    return best.lobe;
}

/// Returns the integral of f |wi.z|.
double reflectanceOf(const std::vector<Node>& nodes) {
    double sum = 0;
    for (const Node& node : nodes)
        sum += node.light;
    return sum;
}

} // namespace

GlossFit::GlossFit(const Brdf& f) {
    for (int i = 0; i <= kSteps; ++i) {
        const float cosO = std::max(float(i) / kSteps, .01f); // at the horizon itself there is nothing to fit
        const V3f wo(safeSqrt(1 - cosO * cosO), 0, cosO);
        const std::vector<Node> nodes = quadrature(f, wo);
        const Lobe lobe = bestLobe(nodes, wo);
        m_probability[i] = lobe.probability;
        m_along[i] = lobe.alpha.along;
        m_across[i] = lobe.alpha.across;
        m_reflectance[i] = float(reflectanceOf(nodes));
    }
    const float largest = *std::max_element(std::begin(m_reflectance), std::end(m_reflectance));
    for (float& reflectance : m_reflectance)
        reflectance = largest > 0 ? std::max(reflectance, largest / 1000) : 1;
}

} // namespace strobe
