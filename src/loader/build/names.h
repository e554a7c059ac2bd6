// Names for layers: of shapes and materials that the scene gives none.
#pragma once

#include "loader/parser/description.h"

namespace strobe {

/// Reads the names that shapes' parameters give. Other shapes of the world are called after their file or
/// their kind, with a number; other shapes of objects are parts of their instances.
void nameShapes(SceneDescription& description);

/// Reads the group that a light's parameters put it in and returns its number: its place in `groups`, to
/// which a new name is appended. Lights of no group are the group "rest". Throws a located Error for a name
/// that no layer may have.
int groupOf(const ParamSet& light, std::vector<std::string>& groups);

/// Names of materials: their own, or their kind and a number. The first is the "default".
std::vector<std::string> cryptomatteNames(const std::vector<MaterialDecl>& materials);

} // namespace strobe
