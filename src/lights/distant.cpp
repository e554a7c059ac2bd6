#include "lights/distant.h"

#include "core/math/sampling.h"
#include "lights/delta.h"
#include "lights/placement.h"

namespace strobe {

namespace {

const ParamDef<Rgb> kL{"L", Rgb(1), "irradiance of a surface that faces the light, W/m²"};
const ParamDef<V3f> kFrom{"from", V3f(0), "start point of the direction of the light, in light space"};
const ParamDef<V3f> kTo{"to", V3f(0, 0, 1), "end point of the direction of the light, in light space"};
const ParamDef<float> kAngle{
    "angle", 0, "angular diameter in degrees, at most 179: a disk that only light sampling sees; 0: a point"};

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

/// A disk at infinity of constant radiance. Rays do not hit it: light sampling counts in full.
class DistantDisk final : public Light {
  public:
    /// `halfAngle`: of the disk, in radians, below a right angle. `irradiance`: of a surface that faces the
    /// center.
    DistantDisk(const LightPlacement& placement, const V3f& toLight, const Rgb& irradiance, float halfAngle)
        : m_placement(placement), m_toLight(toLight), m_irradiance(irradiance),
          m_oneMinusCos(oneMinusCos(std::sin(halfAngle) * std::sin(halfAngle))),
          m_radiance(irradiance * (kInvPi / (std::sin(halfAngle) * std::sin(halfAngle)))) {}
    void sample(const V3f&, float time, const V2f* u, int n, LightSample* out) const override {
        const Frame frame = Frame::fromNormal(normalize(transformVector(m_placement.at(time), m_toLight)));
        for (int i = 0; i < n; ++i)
            out[i] = {frame.toWorld(uniformCone(u[i], m_oneMinusCos)), kInfinity, m_radiance,
                      uniformConePdf(m_oneMinusCos)};
    }
    float pdf(const V3f&, float, const V3f&, const LightHit*) const override { return 0; }
    bool mayIntersect(const V3f&, float, const V3f&) const override { return false; }
    float solidAngle(const V3f&, float) const override { return 0; }
    Rgb power(float radius) const override { return m_irradiance * (kPi * radius * radius); }

  private:
    LightPlacement m_placement;
    V3f m_toLight; ///< from the scene to the center of the disk, in light space
    Rgb m_irradiance;
    float m_oneMinusCos; ///< of the half-angle
    Rgb m_radiance;
};

} // namespace

Plugin<std::shared_ptr<Light>, const LightArgs&> distantLightPlugin() {
    return {"distant",
            "parallel light from a direction",
            {kL, kLightScale, kIlluminance, kFrom, kTo, kAngle, kLightSamples},
            [](const ParamSet& params, const BuildContext& context, const LightArgs& args) {
                const V3f toLight = params.get(kFrom) - params.get(kTo);
                if (toLight == V3f(0))
                    throw Error(params.whereIs(kTo), "\"from\" and \"to\" are the same point");
                const float angle = params.get(kAngle);
                if (!(angle >= 0 && angle <= 179))
                    throw Error(params.whereIs(kAngle), "\"angle\" is not between 0 and 179");
                const LightPlacement placement(args, context.conventions);
                const Rgb irradiance =
                    readEmission(params, kL, context) * scaleToTotal(params, kIlluminance, 1);
                std::shared_ptr<Light> light;
                if (angle > 0)
                    light = std::make_shared<DistantDisk>(placement, toLight, irradiance, radians(angle) / 2);
                else
                    light = std::make_shared<DistantLight>(placement, toLight, irradiance);
                light->sampleCount = params.get(kLightSamples);
                return light;
            }};
}

} // namespace strobe
