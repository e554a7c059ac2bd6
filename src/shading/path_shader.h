// shade(): the path tracer. Next-event estimation with multiple importance sampling, in waves over a batch.
#pragma once

#include "core/render/shader.h"

namespace strobe {

/// Direct light at the first surface that is not a mirror or glass.
ShaderPlugin directLightingPlugin();
/// Paths of up to `maxdepth` surfaces, Russian roulette beyond the third.
ShaderPlugin pathPlugin();

} // namespace strobe
