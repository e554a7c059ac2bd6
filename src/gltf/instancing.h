// Instances of a node's mesh: EXT_mesh_gpu_instancing.
#pragma once

#include "gltf/file/document.h"

#include "core/math/math.h"

namespace strobe::gltf {

/// Returns the transforms of the instances of a node's mesh to the node: the identity if it has none of its
/// own. Throws an Error if an attribute is invalid.
std::vector<M44f> instanceTransforms(const Document& document, size_t node);

} // namespace strobe::gltf
