// Checks of the items of a glTF document, one by one. Used by conformance.cpp only.
#pragma once

#include "gltf/file/conformance.h"

namespace strobe::gltf {

/// Appends deviations of cameras, lights, materials, meshes, nodes, skins, animations and images.
void checkItems(const nlohmann::json& root, Deviations& out);

/// Appends deviations of buffers, buffer views and accessors: sizes, alignment, strides and uses.
void checkLayout(const nlohmann::json& root, Deviations& out);

} // namespace strobe::gltf
