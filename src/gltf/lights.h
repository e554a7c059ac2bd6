// Lights (KHR_lights_punctual) and cameras.
#pragma once

#include "gltf/import.h"
#include "gltf/nodes.h"

namespace strobe::gltf {

/// The lights of the tree's nodes. Photometric units become radiometric ones as Blender's exporter makes
/// them: candela and lux are divided by 683 lm/W.
std::vector<ImportedLight> importLights(const NodeTree& tree, const Clip& clip, Diagnostics& messages);

/// The camera called `name` (itself or its node), or the first of the tree; nothing when there is none.
std::optional<ImportedCamera> importCamera(const NodeTree& tree, const std::string& name);

} // namespace strobe::gltf
