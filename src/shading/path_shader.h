// The shaders `path` and `directlighting`: path tracing with next-event estimation and multiple importance
// sampling, in waves over a batch.
#pragma once

#include "core/render/shader.h"

namespace strobe {

/// The shader `directlighting`: direct light at the first non-specular vertex.
ShaderPlugin directLightingPlugin();
/// The shader `path`: paths of up to `maxdepth` vertices, with Russian roulette from the fourth on.
ShaderPlugin pathPlugin();

} // namespace strobe
