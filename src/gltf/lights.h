// Lights (KHR_lights_punctual) and cameras.
#pragma once

#include "core/util/diagnostics.h"
#include "gltf/import.h"
#include "gltf/nodes.h"

namespace strobe::gltf {

/// Returns the lights of the tree's nodes. `photometric`: candela and lux are divided by 683 lm/W, as in
/// Blender's exporter; else they are taken as radiometric units.
std::vector<ImportedLight> importLights(const NodeTree& tree, const Clip& clip, bool photometric,
                                        Diagnostics& diagnostics);

/// Returns the camera of that name (its own or its node's); if `name` is empty, the first camera of the tree,
/// or nothing if there is none. Throws an Error if the name is unknown.
std::optional<ImportedCamera> importCamera(const NodeTree& tree, const std::string& name);

} // namespace strobe::gltf
