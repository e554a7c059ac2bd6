// The shutter interval: parameters of all cameras.
#pragma once

#include "core/math/transform.h"
#include "core/params/params.h"

namespace strobe {

inline const ParamDef<float> kShutterOpen{"shutteropen", 0, "scene time at which the shutter opens"};
inline const ParamDef<float> kShutterClose{"shutterclose", 1, "scene time at which the shutter closes"};

/// Returns the shutter interval in scene time. Throws a located Error if it is not finite or closes before it
/// opens.
Shutter readShutter(const ParamSet& params);

} // namespace strobe
