#include "lights/distant.h"

#include "lights/delta.h"
#include "lights/placement.h"

namespace strobe {

namespace {

const ParamDef<Rgb> kL{"L", Rgb(1), "irradiance of a surface facing the light"};
const ParamDef<V3f> kFrom{"from", V3f(0), "the light comes from here, in light space"};
const ParamDef<V3f> kTo{"to", V3f(0, 0, 1), "and goes there"};

class DistantLight final : public DeltaLight {
  public:
    DistantLight(const LightPlacement& placement, const V3f& towards, const Rgb& radiance)
        : m_placement(placement), m_towards(towards), m_radiance(radiance) {}
    LightSample only(const V3f&, float time) const override {
        return {normalize(transformVector(m_placement.at(time), m_towards)), kInfinity, m_radiance, 1};
    }
    Rgb power(float radius) const override { return m_radiance * (kPi * radius * radius); }

  private:
    LightPlacement m_placement;
    V3f m_towards; ///< from the scene to the light, in light space
    Rgb m_radiance;
};

} // namespace

Plugin<std::shared_ptr<Light>, const LightArgs&> distantLightPlugin() {
    return {"distant",
            "parallel light",
            {kL, kLightScale, kIlluminance, kFrom, kTo, kLightSamples},
            [](const ParamSet& params, const BuildContext& context, const LightArgs& args) {
                const V3f towards = params.get(kFrom) - params.get(kTo);
                if (towards == V3f(0))
                    throw Error(params.whereIs(kTo), "\"from\" and \"to\" are the same point");
                auto light = std::make_shared<DistantLight>(
                    LightPlacement(args, context.conventions), towards,
                    readEmission(params, kL) * readTotal(params, kIlluminance, 1));
                light->sampleCount = params.get(kLightSamples);
                return light;
            }};
}

} // namespace strobe
