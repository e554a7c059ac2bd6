#include "lights/point.h"

#include "lights/delta.h"
#include "lights/placement.h"

namespace strobe {

namespace {

const ParamDef<Rgb> kI{"I", Rgb(1), "radiant intensity, W/sr"};
const ParamDef<V3f> kFrom{"from", V3f(0), "position in light space"};

class PointLight final : public DeltaLight {
  public:
    PointLight(const LightPlacement& placement, const V3f& from, const Rgb& intensity)
        : m_placement(placement), m_from(from), m_intensity(intensity),
          m_start(transformPoint(placement.at(0), from)) {}
    LightSample deltaSample(const V3f& p, float time) const override {
        const V3f position = m_placement.isStatic() ? m_start : transformPoint(m_placement.at(time), m_from);
        return fromPoint(p, position, m_intensity);
    }
    void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const override {
        if (m_placement.isStatic())
            sampleSoAFrom(m_start, m_intensity, query, out);
        else
            DeltaLight::sampleSoA(query, out);
    }
    Rgb power(float) const override { return m_intensity * (4 * kPi); }
    std::optional<EmitterBounds> emitterBounds(uint32_t, float begin, float end) const override {
        EmitterBounds bounds;
        bounds.intensity = rootMeanSquare(m_intensity);
        m_placement.bound(m_from, V3f(0, 0, 1), kPi, begin, end, bounds);
        return bounds;
    }

  private:
    static void sampleSoAFrom(const V3f& position, const Rgb& intensity, const LightQuerySoA& query,
                              LightSampleSoA& out);

    LightPlacement m_placement;
    V3f m_from;
    Rgb m_intensity;
    V3f m_start; ///< position in world space when the shutter opens
};

STROBE_TARGET_CLONES void PointLight::sampleSoAFrom(const V3f& position, const Rgb& intensity,
                                                    const LightQuerySoA& query, LightSampleSoA& out) {
    const V3f from = position; // local copies, which the stores of the loop cannot alias
    const Rgb localIntensity = intensity;
    STROBE_IVDEP
    for (int i = 0; i < query.n; ++i) {
        out.set(i, fromPoint(query.p.at(i), from, localIntensity));
    }
}

} // namespace

Plugin<std::shared_ptr<Light>, const LightArgs&> pointLightPlugin() {
    return {"point",
            "equal intensity in all directions from a point",
            {kI, kLightScale, kPower, kFrom, kLightSamples},
            [](const ParamSet& params, const BuildContext& context, const LightArgs& args) {
                auto light = std::make_shared<PointLight>(
                    LightPlacement(args, context.conventions), params.get(kFrom),
                    readEmission(params, kI, context) * scaleToTotal(params, kPower, 4 * kPi));
                light->sampleCount = params.get(kLightSamples);
                return light;
            }};
}

} // namespace strobe
