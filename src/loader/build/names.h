// Names of shapes, materials and light groups, as AOVs and Cryptomatte use them.
#pragma once

#include "loader/parser/description.h"

namespace strobe {

/// Sets the names of shapes from their "name" parameters. Unnamed shapes of the world get the name of their
/// file or plugin and a number. Unnamed shapes of objects stay unnamed: they belong to their instances.
void nameShapes(SceneDescription& description);

/// Returns the index in `groups` of the light group that a light's parameters name, or of "rest" if they name
/// none; appends the name if it is new. Throws a located Error if the name has other characters than letters,
/// digits and underscores.
int lightGroupIndex(const ParamSet& light, std::vector<std::string>& groups);

/// Returns the Cryptomatte name of each material: its own name, or its plugin and a number. The first
/// material, which is unnamed, is "default".
std::vector<std::string> cryptomatteNames(const std::vector<MaterialDecl>& materials);

} // namespace strobe
