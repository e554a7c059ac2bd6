#include "lights/distant.h"

#include "lights/delta.h"
#include "lights/placement.h"

namespace strobe {

namespace {

const ParamDef<Rgb> kL{"L", Rgb(1), "irradiance of a surface that faces the light, W/m²"};
const ParamDef<V3f> kFrom{"from", V3f(0), "start point of the direction of the light, in light space"};
const ParamDef<V3f> kTo{"to", V3f(0, 0, 1), "end point of the direction of the light, in light space"};

class DistantLight final : public DeltaLight {
  public:
    DistantLight(const LightPlacement& placement, const V3f& toLight, const Rgb& irradiance)
        : m_placement(placement), m_toLight(toLight), m_irradiance(irradiance) {}
    LightSample deltaSample(const V3f&, float time) const override {
        return {normalize(transformVector(m_placement.at(time), m_toLight)), kInfinity, m_irradiance, 1};
    }
    Rgb power(float radius) const override { return m_irradiance * (kPi * radius * radius); }

  private:
    LightPlacement m_placement;
    V3f m_toLight; ///< from the scene to the light, in light space
    Rgb m_irradiance;
};

} // namespace

Plugin<std::shared_ptr<Light>, const LightArgs&> distantLightPlugin() {
    return {"distant",
            "parallel light from a direction",
            {kL, kLightScale, kIlluminance, kFrom, kTo, kLightSamples},
            [](const ParamSet& params, const BuildContext& context, const LightArgs& args) {
                const V3f toLight = params.get(kFrom) - params.get(kTo);
                if (toLight == V3f(0))
                    throw Error(params.whereIs(kTo), "\"from\" and \"to\" are the same point");
                auto light = std::make_shared<DistantLight>(
                    LightPlacement(args, context.conventions), toLight,
                    readEmission(params, kL, context) * scaleToTotal(params, kIlluminance, 1));
                light->sampleCount = params.get(kLightSamples);
                return light;
            }};
}

} // namespace strobe
