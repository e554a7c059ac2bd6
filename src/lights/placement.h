// What the lights without a shape share: their transform over the shutter, and common parameters.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

inline const ParamDef<Rgb> kLightScale{"scale", Rgb(1), "factor of the emission"};
inline const ParamDef<int> kLightSamples{
    "nsamples", 1, "samples per shading point", "samples", {1, kMaxLightSamples}};

/// pbrt-v4: what the whole light is to give. 0: as its intensity says.
inline const ParamDef<float> kPower{"power", 0,
                                    "total power of a white light, in place of the intensity's size"};
inline const ParamDef<float> kIlluminance{
    "illuminance", 0,
    "irradiance by a white light of a surface that faces it, in place of the radiance's size"};
/// `def`'s value over `ofUnit`, what a light of intensity (or radiance) 1 gives; 1 when it is not given.
/// Throws a located Error unless it is positive.
float readTotal(const ParamSet& params, const ParamDef<float>& def, float ofUnit);

/// "scale": one number, or one per channel.
Rgb readLightScale(const ParamSet& params);
/// The emission `def` times "scale"; throws a located Error when it is negative or not finite.
Rgb readEmission(const ParamSet& params, const ParamDef<Rgb>& def);

/// The light-to-world transform. In pbrt-v2's conventions lights stand still at their first key.
class LightPlacement {
  public:
    LightPlacement(const LightArgs& args, Conventions conventions);
    bool isStatic() const { return m_toWorld.isStatic(); }
    /// At shutter fraction `time`.
    M44f at(float time) const { return m_toWorld.at(m_shutter.sceneTime(time)); }

  private:
    KeyedTransform m_toWorld;
    Shutter m_shutter;
};

} // namespace strobe
