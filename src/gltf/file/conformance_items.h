// Checks of the items of a glTF document, one by one. Used by conformance.cpp only.
#pragma once

#include "gltf/file/conformance.h"

namespace strobe::gltf {

/// Appends deviations of accessors, cameras, materials, meshes, nodes, skins, animations and images.
void checkItems(const nlohmann::json& root, Deviations& out);

} // namespace strobe::gltf
