#include "filters/sinc.h"

#include "filters/separable.h"

namespace strobe {

namespace {

const WidthParams kWidths(4);
const ParamDef<float> kTau{"tau", 3,
                           "first zero of the window, in pixels, 1 to 32; under pbrt-v2's conventions: "
                           "number of lobes in the half-width"};

float sinc(float x) {
    x = std::abs(kPi * x);
    return x < 1e-4f ? 1 : std::sin(x) / x;
}

Profile sincProfile(float radius, float tau, bool v2) {
    if (v2) // the factors are exchanged and both relative to the half-width
        return Profile(radius, [=](float x) { return sinc(x / radius) * sinc(x * tau / radius); });
    return Profile(radius, [=](float x) { return sinc(x) * sinc(x / tau); });
}

std::shared_ptr<const Filter> createSinc(const ParamSet& params, const BuildContext& context) {
    const float tau = params.get(kTau);
    if (!(tau >= 1 && tau <= 32))
        throw Error(params.whereIs(kTau), "\"tau\" must be between 1 and 32");
    const V2f radius = kWidths.read(params);
    const bool v2 = context.conventions == Conventions::PbrtV2;
    return makeSeparable(sincProfile(radius.x, tau, v2), sincProfile(radius.y, tau, v2));
}

} // namespace

Plugin<std::shared_ptr<const Filter>> sincFilterPlugin() {
    return {"sinc", "Lanczos-windowed sinc", {kWidths.x, kWidths.y, kTau}, createSinc};
}

} // namespace strobe
