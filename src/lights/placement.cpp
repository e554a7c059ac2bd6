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

namespace {

/// Whether pbrt-v4 divides the emission by its luminance: spectra and blackbodies are colors only. (A
/// blackbody with a scale is one of pbrt-v2 or v3.)
bool isNormalized(const ParamSet& params, const ParamDef<Rgb>& def, const BuildContext& context) {
    const auto type = params.typeOf(def);
    if (context.pbrtVersion != 4 || !type)
        return false;
    const auto isScaled = [&](const Param& p) { return p.name == def.name && p.floats.size() == 2; };
    const std::vector<Param>& all = params.all();
    return *type == ParamType::Spectrum ||
           (*type == ParamType::Blackbody && std::none_of(all.begin(), all.end(), isScaled));
}

} // namespace

Rgb readEmission(const ParamSet& params, const ParamDef<Rgb>& def, const BuildContext& context) {
    Rgb color = params.get(def);
    const auto type = params.typeOf(def);
    if (type == ParamType::Spectrum || type == ParamType::Blackbody) // may lie outside of the working space
        color = {std::max(color.x, 0.f), std::max(color.y, 0.f), std::max(color.z, 0.f)};
    if (const float y = luminance(color); isNormalized(params, def, context) && y > 0)
        color = color / y;
    const Rgb emission = color * readLightScale(params);
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

void LightPlacement::bound(const V3f& point, const V3f& axis, float spread, float begin, float end,
                           EmitterBounds& bounds) const {
    const int keys = m_toWorld.isStatic() ? 1 : int(m_toWorld.times().size());
    const bool isRound = spread >= kPi; // then the axis does not matter
    const auto poseAt = [&](float time) {
        const M44f m = at(time);
        return EmitterPose{transformPoint(m, point), 0,
                           isRound ? axis : normalizeAny(transformVector(m, axis)), spread};
    };
    boundPoses(posesOf(keys, begin, end, poseAt), bounds);
}

} // namespace strobe
