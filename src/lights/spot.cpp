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
STROBE_FORCE_INLINE float oneMinusCosBetween(const V3f& a, const V3f& b) { return length2(a - b) / 2; }

/// The polynomial of x = (cos θ - cos edge) / (cos full - cos edge): x⁴, x² (3 - 2x) or x².
enum class Falloff { Quartic, Smoothstep, Squared };

/// The cone of a spot light: 1 - cos of the angles of zero and of full intensity, and the falloff in between.
struct Cone {
    float edge, full;
    Falloff falloff;

    /// Returns the falloff for 1 - cos of the angle from the axis.
    STROBE_FORCE_INLINE float at(float oneMinusCos) const {
        const float x = (edge - oneMinusCos) / (edge - full);
        const float inside = falloff == Falloff::Quartic      ? sqr(sqr(x))
                             : falloff == Falloff::Smoothstep ? x * x * (3 - 2 * x)
                                                              : sqr(x);
        return oneMinusCos <= full ? 1 : oneMinusCos >= edge ? 0 : inside;
    }
};

class SpotLight final : public DeltaLight {
  public:
    SpotLight(const LightPlacement& placement, const V3f& from, const V3f& to, const Rgb& intensity,
              const Cone& cone)
        : m_placement(placement), m_from(from), m_axis(to - from), m_intensity(intensity),
          m_cone(cone), m_start{positionAt(0), axisAt(0)} {}
    LightSample deltaSample(const V3f& p, float time) const override {
        return m_placement.isStatic() ? sampleFrom(m_start, p, m_intensity, m_cone)
                                      : sampleFrom({positionAt(time), axisAt(time)}, p, m_intensity, m_cone);
    }
    void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const override {
        if (m_placement.isStatic())
            sampleSoAFrom(m_start, m_intensity, m_cone, query, out);
        else
            DeltaLight::sampleSoA(query, out);
    }
    Rgb power(float) const override { return m_intensity * (kPi * (m_cone.full + m_cone.edge)); }
    /// The directions of full intensity are the normals; the falloff ends at the edge of the cone.
    std::optional<EmitterBounds> emitterBounds(uint32_t, float begin, float end) const override {
        constexpr float kMargin = 1e-3f; // radians, for rounding
        const float edge = std::acos(std::clamp(1 - m_cone.edge, -1.f, 1.f));
        const float full = std::acos(std::clamp(1 - m_cone.full, -1.f, 1.f));
        EmitterBounds bounds;
        bounds.emission = std::min(edge - full + kMargin, kPi);
        bounds.intensity = rootMeanSquare(m_intensity);
        m_placement.bound(m_from, m_axis, full, begin, end, bounds);
        return bounds;
    }

  private:
    /// The position and the unit axis in world space.
    struct Pose {
        V3f position, axis;
    };

    V3f positionAt(float time) const { return transformPoint(m_placement.at(time), m_from); }
    V3f axisAt(float time) const { return normalize(transformVector(m_placement.at(time), m_axis)); }
    static STROBE_FORCE_INLINE LightSample sampleFrom(const Pose& pose, const V3f& p, const Rgb& intensity,
                                                      const Cone& cone) {
        LightSample s = fromPoint(p, pose.position, intensity);
        const float falloff = cone.at(oneMinusCosBetween(-s.wi, pose.axis));
        s.radiance.x *= falloff;
        s.radiance.y *= falloff;
        s.radiance.z *= falloff;
        return s;
    }
    static void sampleSoAFrom(const Pose& pose, const Rgb& intensity, const Cone& cone,
                              const LightQuerySoA& query, LightSampleSoA& out);

    LightPlacement m_placement;
    V3f m_from, m_axis;
    Rgb m_intensity;
    Cone m_cone;
    Pose m_start; ///< when the shutter opens
};

STROBE_TARGET_CLONES void SpotLight::sampleSoAFrom(const Pose& pose, const Rgb& intensity, const Cone& cone,
                                                   const LightQuerySoA& query, LightSampleSoA& out) {
    const Pose localPose = pose; // local copies, which the stores of the loop cannot alias
    const Rgb localIntensity = intensity;
    const Cone localCone = cone;
    STROBE_IVDEP
    for (int i = 0; i < query.n; ++i) {
        out.set(i, sampleFrom(localPose, query.p.at(i), localIntensity, localCone));
    }
}

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
                                             Cone{edge, full, falloffFrom(params, context)});
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
