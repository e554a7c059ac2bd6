#include "lights/spot.h"

#include "lights/delta.h"
#include "lights/placement.h"

namespace strobe {

namespace {

const ParamDef<Rgb> kI{"I", Rgb(1), "radiant intensity on the axis"};
const ParamDef<V3f> kFrom{"from", V3f(0), "position, in light space"};
const ParamDef<V3f> kTo{"to", V3f(0, 0, 1), "a point on the axis, in light space"};
const ParamDef<float> kConeAngle{"coneangle", 30, "angle between axis and rim, in degrees"};
const ParamDef<float> kConeDelta{"conedeltaangle", 5, "width of the soft rim, inside coneangle, in degrees",
                                 nullptr, kNotNegative};

const ParamDef<std::string> kFalloff{
    "falloff", "", "across the rim: quartic (default in v2), smoothstep (default in v4) or squared (glTF)"};

/// 1 - cos θ of an angle θ, exact for narrow cones, too.
float oneMinusCosOf(float degrees) { return 2 * sqr(std::sin(radians(degrees) / 2)); }

/// The same of the angle between unit vectors.
float oneMinusCosBetween(const V3f& a, const V3f& b) { return length2(a - b) / 2; }

/// pbrt-v2 and v3 fall off with the fourth power, v4 with smoothstep, glTF with the square.
enum class Falloff { Quartic, Smoothstep, Squared };

class SpotLight final : public DeltaLight {
  public:
    SpotLight(const LightPlacement& placement, const V3f& from, const V3f& to, const Rgb& intensity,
              float rim, float full, Falloff falloff)
        : m_placement(placement), m_from(from), m_axis(to - from), m_intensity(intensity), m_rim(rim),
          m_full(full), m_falloff(falloff) {}
    LightSample only(const V3f& p, float time) const override {
        const M44f m = m_placement.at(time);
        const V3f axis = normalize(transformVector(m, m_axis));
        LightSample s = fromPoint(p, transformPoint(m, m_from), m_intensity);
        s.radiance *= falloff(oneMinusCosBetween(-s.wi, axis));
        return s;
    }
    Rgb power(float) const override { return m_intensity * (kPi * (m_full + m_rim)); }

  private:
    float falloff(float angle) const {
        if (angle <= m_full)
            return 1;
        if (angle >= m_rim)
            return 0;
        const float x = (m_rim - angle) / (m_rim - m_full);
        return m_falloff == Falloff::Quartic      ? sqr(sqr(x))
               : m_falloff == Falloff::Smoothstep ? x * x * (3 - 2 * x)
                                                  : sqr(x);
    }

    LightPlacement m_placement;
    V3f m_from, m_axis;
    Rgb m_intensity;
    float m_rim, m_full; ///< angles from the axis: 1 - their cosines
    Falloff m_falloff;
};

Falloff falloffFrom(const ParamSet& params, const BuildContext& context) {
    const std::string name = params.get(kFalloff);
    if (name.empty())
        return context.conventions == Conventions::PbrtV2 ? Falloff::Quartic : Falloff::Smoothstep;
    if (name == "quartic")
        return Falloff::Quartic;
    if (name == "smoothstep")
        return Falloff::Smoothstep;
    if (name == "squared")
        return Falloff::Squared;
    throw Error(params.whereIs(kFalloff),
                "unknown falloff \"" + name + "\" (known: quartic, smoothstep, squared)");
}

std::shared_ptr<Light> createSpot(const ParamSet& params, const BuildContext& context,
                                  const LightArgs& args) {
    const V3f from = params.get(kFrom), to = params.get(kTo);
    if (from == to)
        throw Error(params.whereIs(kTo), "\"from\" and \"to\" are the same point");
    const float rim = params.get(kConeAngle), delta = params.get(kConeDelta);
    if (!(rim > 0 && rim <= 180))
        throw Error(params.whereIs(kConeAngle), "\"coneangle\" must be above 0 and at most 180 degrees");
    const float full = std::max(rim - delta, 0.f);
    const float rimPart = oneMinusCosOf(rim), fullPart = oneMinusCosOf(full);
    const Rgb intensity = readEmission(params, kI) * readTotal(params, kPower, kPi * (fullPart + rimPart));
    auto light = std::make_shared<SpotLight>(LightPlacement(args, context.conventions), from, to, intensity,
                                             rimPart, fullPart, falloffFrom(params, context));
    light->sampleCount = params.get(kLightSamples);
    return light;
}

} // namespace

Plugin<std::shared_ptr<Light>, const LightArgs&> spotLightPlugin() {
    return {"spot",
            "a point light that shines into a cone",
            {kI, kLightScale, kPower, kFrom, kTo, kConeAngle, kConeDelta, kFalloff, kLightSamples},
            createSpot};
}

} // namespace strobe
