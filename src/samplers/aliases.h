// Sampler names of pbrt.
#pragma once

#include <map>
#include <string>

namespace strobe {

/// Returns the sampler names of pbrt that strobe does not have, with the name of the sampler that replaces
/// each.
std::map<std::string, std::string> samplerAliases();

} // namespace strobe
