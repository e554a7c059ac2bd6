#include "filters/gaussian.h"

#include "filters/separable.h"

namespace strobe {

namespace {

const WidthParams kWidths(1.5f);
const ParamDef<float> kAlpha{
    "alpha", 2,
    "falloff exp(-alpha x²), x in pixels (pbrt-v2 and v3; the default under pbrt-v2's conventions)", nullptr,
    kPositive};
const ParamDef<float> kSigma{"sigma", 0.5f, "standard deviation in pixels (pbrt-v4)", nullptr, kPositive};

Profile gaussianProfile(float radius, float alpha) {
    const float range = alpha * radius * radius, end = std::exp(-range);
    return Profile(radius, [=](float x) {
        const float a = alpha * x * x;
        // expm1 avoids cancellation for a Gaussian that is wide relative to its support.
        return std::max(0.f, range < 1 ? end * std::expm1(range - a) : std::exp(-a) - end);
    });
}

std::shared_ptr<const Filter> createGaussian(const ParamSet& params, const BuildContext& context) {
    if (params.has(kAlpha) && params.has(kSigma))
        throw Error(params.whereIs(kSigma), "\"alpha\" and \"sigma\" must not both be given");
    const bool v2 = context.conventions == Conventions::PbrtV2;
    const bool byAlpha = params.has(kAlpha) || (v2 && !params.has(kSigma));
    const float alpha = byAlpha ? params.get(kAlpha) : .5f / sqr(params.get(kSigma));
    const V2f radius = kWidths.read(params, byAlpha ? 2 : kWidths.x.fallback);
    if (alpha * sqr(std::max(radius.x, radius.y)) > 2000) // beyond the resolution of the table
        throw Error(params.whereIs(byAlpha ? kAlpha : kSigma),
                    "the Gaussian is too narrow for the width of the filter");
    return makeSeparable(gaussianProfile(radius.x, alpha), gaussianProfile(radius.y, alpha));
}

} // namespace

Plugin<std::shared_ptr<const Filter>> gaussianFilterPlugin() {
    return {"gaussian",
            "Gaussian minus its value at the half-width (default half-width with alpha: 2)",
            {kWidths.x, kWidths.y, kAlpha, kSigma},
            createGaussian};
}

} // namespace strobe
