#include "lights/spot.h"

#include "lights/delta.h"
#include "lights/placement.h"

namespace strobe {

namespace {

const ParamDef<Rgb> kI{"I", Rgb(1), "radiant intensity on the axis, W/sr"};
const ParamDef<V3f> kFrom{"from", V3f(0), "position in light space"};
const ParamDef<V3f> kTo{"to", V3f(0, 0, 1), "point on the axis in light space"};
const ParamDef<float> kConeAngle{
    "coneangle", 30, "angle between the axis and the edge of the cone, in degrees, above 0, at most 180"};
const ParamDef<float> kConeDelta{"conedeltaangle", 5, "width of the falloff inside coneangle, in degrees",
                                 nullptr, kNotNegative};

const ParamDef<std::string> kFalloff{"falloff", "",
                                     "falloff at the edge: quartic, smoothstep or squared (glTF); default: "
                                     "quartic in files of pbrt-v2 and v3, else smoothstep"};

/// Returns 1 - cos θ of an angle, accurate for narrow cones.
float oneMinusCosDegrees(float degrees) { return 2 * sqr(std::sin(radians(degrees) / 2)); }

/// Returns 1 - cos θ of the angle between unit vectors.
float oneMinusCosBetween(const V3f& a, const V3f& b) { return length2(a - b) / 2; }

/// The polynomial of x = (cos θ - cos edge) / (cos full - cos edge): x⁴, x² (3 - 2x) or x².
enum class Falloff { Quartic, Smoothstep, Squared };

class SpotLight final : public DeltaLight {
  public:
    SpotLight(const LightPlacement& placement, const V3f& from, const V3f& to, const Rgb& intensity,
              float edge, float full, Falloff falloff)
        : m_placement(placement), m_from(from), m_axis(to - from), m_intensity(intensity), m_edge(edge),
          m_full(full), m_falloff(falloff) {}
    LightSample deltaSample(const V3f& p, float time) const override {
        const M44f m = m_placement.at(time);
        const V3f axis = normalize(transformVector(m, m_axis));
        LightSample s = fromPoint(p, transformPoint(m, m_from), m_intensity);
        s.radiance *= falloff(oneMinusCosBetween(-s.wi, axis));
        return s;
    }
    Rgb power(float) const override { return m_intensity * (kPi * (m_full + m_edge)); }
    /// The directions of full intensity are the normals; the falloff ends at the edge of the cone.
    std::optional<EmitterBounds> emitterBounds(uint32_t, float begin, float end) const override {
        constexpr float kMargin = 1e-3f; // radians, for rounding
        const float edge = std::acos(std::clamp(1 - m_edge, -1.f, 1.f));
        const float full = std::acos(std::clamp(1 - m_full, -1.f, 1.f));
        EmitterBounds bounds;
        bounds.emission = std::min(edge - full + kMargin, kPi);
        bounds.intensity = rootMeanSquare(m_intensity);
        m_placement.bound(m_from, m_axis, full, begin, end, bounds);
        return bounds;
    }

  private:
    /// Returns the falloff for 1 - cos of the angle from the axis.
    float falloff(float oneMinusCos) const {
        if (oneMinusCos <= m_full)
            return 1;
        if (oneMinusCos >= m_edge)
            return 0;
        const float x = (m_edge - oneMinusCos) / (m_edge - m_full);
        return m_falloff == Falloff::Quartic      ? sqr(sqr(x))
               : m_falloff == Falloff::Smoothstep ? x * x * (3 - 2 * x)
                                                  : sqr(x);
    }

    LightPlacement m_placement;
    V3f m_from, m_axis;
    Rgb m_intensity;
    float m_edge, m_full; ///< 1 - cos of the angles of zero and of full intensity
    Falloff m_falloff;
};

Falloff falloffFrom(const ParamSet& params, const BuildContext& context) {
    if (params.get(kFalloff).empty())
        return context.pbrtVersion < 4 || context.conventions == Conventions::PbrtV2 ? Falloff::Quartic
                                                                                     : Falloff::Smoothstep;
    return parseWord<Falloff>(
        params, kFalloff,
        {{"quartic", Falloff::Quartic}, {"smoothstep", Falloff::Smoothstep}, {"squared", Falloff::Squared}});
}

std::shared_ptr<Light> createSpot(const ParamSet& params, const BuildContext& context,
                                  const LightArgs& args) {
    const V3f from = params.get(kFrom), to = params.get(kTo);
    if (from == to)
        throw Error(params.whereIs(kTo), "\"from\" and \"to\" are the same point");
    const float angle = params.get(kConeAngle), delta = params.get(kConeDelta);
    if (!(angle > 0 && angle <= 180))
        throw Error(params.whereIs(kConeAngle), "\"coneangle\" must be above 0 and at most 180 degrees");
    const float edge = oneMinusCosDegrees(angle), full = oneMinusCosDegrees(std::max(angle - delta, 0.f));
    const Rgb intensity =
        readEmission(params, kI, context) * scaleToTotal(params, kPower, kPi * (full + edge));
    auto light = std::make_shared<SpotLight>(LightPlacement(args, context.conventions), from, to, intensity,
                                             edge, full, falloffFrom(params, context));
    light->sampleCount = params.get(kLightSamples);
    return light;
}

} // namespace

Plugin<std::shared_ptr<Light>, const LightArgs&> spotLightPlugin() {
    return {"spot",
            "point light that emits into a cone",
            {kI, kLightScale, kPower, kFrom, kTo, kConeAngle, kConeDelta, kFalloff, kLightSamples},
            createSpot};
}

} // namespace strobe
