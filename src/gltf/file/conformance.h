// Deviations of a file's JSON from the glTF specification that do not prevent reading it.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <utility>
#include <vector>

namespace strobe::gltf {

/// JSON paths and messages.
using Deviations = std::vector<std::pair<std::string, std::string>>;

/// Returns the deviations of a document in what its readers do not check: references of items that no scene
/// uses, empty lists, extensions in wrong places, ranges of values, and requirements between members. The
/// data of accessors is not checked.
Deviations findDeviations(const nlohmann::json& root);

} // namespace strobe::gltf
