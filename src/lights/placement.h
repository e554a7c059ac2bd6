// What the lights without a shape share: their transform over the shutter, and common parameters.
#pragma once

#include "core/light.h"
#include "core/plugin.h"

namespace strobe {

inline const ParamDef<Rgb> kLightScale{"scale", Rgb(1), "factor of the emission"};
inline const ParamDef<int> kLightSamples{"nsamples", 1, "samples per shading point", "samples"};

/// "nsamples"; throws a located Error unless it is at least 1.
int readSampleCount(const ParamSet& params);
/// "scale": one number, or one per channel.
Rgb readLightScale(const ParamSet& params);
/// The emission `def` times "scale"; throws a located Error when it is negative or not finite.
Rgb readEmission(const ParamSet& params, const ParamDef<Rgb>& def);

/// The light-to-world transform. In pbrt-v2's conventions lights stand still at their first key.
class LightPlacement {
  public:
    LightPlacement(const LightArgs& args, Conventions conventions);
    bool isStill() const { return m_toWorld.isStill(); }
    /// At shutter fraction `time`.
    M44f at(float time) const { return m_toWorld.at(m_shutter.sceneTime(time)); }

  private:
    KeyedTransform m_toWorld;
    Shutter m_shutter;
};

} // namespace strobe
