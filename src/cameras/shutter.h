// When the shutter is open: parameters that every camera has.
#pragma once

#include "core/math/transform.h"
#include "core/params/params.h"

namespace strobe {

inline const ParamDef<float> kShutterOpen{"shutteropen", 0, "scene time at which the shutter opens"};
inline const ParamDef<float> kShutterClose{"shutterclose", 1, "scene time at which the shutter closes"};

/// The interval of a camera's parameters, in scene time. Throws a located Error when it closes before it
/// opens.
Shutter readShutter(const ParamSet& params);

} // namespace strobe
