#include "filters/mitchell.h"

#include "filters/separable.h"

namespace strobe {

namespace {

const WidthParams kWidths(2);
const ParamDef<float> kB{"B", 1.f / 3, "blur, 0 to 2"};
const ParamDef<float> kC{"C", 1.f / 3, "ringing, 0 to 2; B + 2C = 1 is recommended"};

/// Returns the piecewise cubic at x in [-2, 2].
float mitchellCubic(float x, float b, float c) {
    x = std::abs(x);
    if (x > 1)
        return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x +
                (8 * b + 24 * c)) /
               6;
    return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + (6 - 2 * b)) / 6;
}

Profile mitchellProfile(float radius, float b, float c) {
    return Profile(radius, [=](float x) { return mitchellCubic(2 * x / radius, b, c); });
}

std::shared_ptr<const Filter> createMitchell(const ParamSet& params, const BuildContext&) {
    const float b = params.get(kB), c = params.get(kC);
    for (const ParamDef<float>* def : {&kB, &kC})
        if (const float x = params.get(*def);
            !(x >= 0 && x <= 2)) // beyond 2, the negative lobes almost cancel ∫f
            throw Error(params.whereIs(*def), std::string("\"") + def->name + "\" must be between 0 and 2");
    const V2f radius = kWidths.read(params);
    return makeSeparable(mitchellProfile(radius.x, b, c), mitchellProfile(radius.y, b, c));
}

} // namespace

Plugin<std::shared_ptr<const Filter>> mitchellFilterPlugin() {
    return {"mitchell",
            "piecewise cubic of Mitchell and Netravali",
            {kWidths.x, kWidths.y, kB, kC},
            createMitchell};
}

} // namespace strobe
