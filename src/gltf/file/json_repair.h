// Changes of the JSON of valid glTF files that tinygltf refuses.
#pragma once

#include "gltf/file/conformance.h"

namespace strobe::gltf {

/// The changes that repairJson made.
struct JsonRepair {
    bool isChanged = false;
    std::vector<size_t> unbacked; ///< accessors without a buffer view, which have one in the changed JSON
    Deviations deviations;
};

/// Makes integers that are written as floating-point numbers integers, accessors of unknown types scalars,
/// and gives buffer views to accessors of indices that have none. All are accepted by glTF. `isInteger`:
/// returns whether a member is an integer or a list of integers.
JsonRepair repairJson(nlohmann::json& root, bool (*isInteger)(const std::string& member));

/// Replaces buffers by those of `bytes` zeros.
void replaceBuffer(nlohmann::json& buffer, size_t bytes);

} // namespace strobe::gltf
