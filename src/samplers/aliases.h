// Other renderers' names of samplers.
#pragma once

#include <map>
#include <string>

namespace strobe {

/// pbrt's sampler names that are not this renderer's own, each with the sampler that stands in for it.
std::map<std::string, std::string> samplerAliases();

} // namespace strobe
