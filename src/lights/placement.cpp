#include "lights/placement.h"

namespace strobe {

float scaleToTotal(const ParamSet& params, const ParamDef<float>& def, float unitTotal) {
    if (!params.has(def))
        return 1;
    const float total = params.get(def);
    if (!(total > 0 && std::isfinite(total)))
        throw Error(params.whereIs(def), std::string("\"") + def.name + "\" must be positive");
    if (!(unitTotal > 0))
        throw Error(params.whereIs(def),
                    std::string("\"") + def.name + "\": the light is black and cannot be scaled");
    return total / unitTotal;
}

Rgb readLightScale(const ParamSet& params) {
    // A color in pbrt-v2, a number in pbrt-v4.
    for (const Param& p : params.all())
        if (p.name == kLightScale.name && p.type == ParamType::Float)
            return Rgb(params.get(ParamDef<float>{kLightScale.name, 1, kLightScale.doc}));
    return params.get(kLightScale);
}

Rgb readEmission(const ParamSet& params, const ParamDef<Rgb>& def) {
    const Rgb emission = params.get(def) * readLightScale(params);
    if (!isFinite(emission) || emission.x < 0 || emission.y < 0 || emission.z < 0) {
        const Location where = params.has(def) ? params.whereIs(def) : params.whereIs(kLightScale);
        throw Error(where, std::string("\"") + def.name + "\" must be finite and not negative");
    }
    return emission;
}

LightPlacement::LightPlacement(const LightArgs& args, Conventions conventions)
    : m_toWorld(conventions == Conventions::PbrtV2 ? KeyedTransform(args.toWorld.keys().front())
                                                   : args.toWorld),
      m_shutter(args.shutter) {}

} // namespace strobe
