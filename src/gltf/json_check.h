// What is looked at in a glTF file's JSON before tinygltf sees it: what tinygltf would let pass, drop
// silently or fall over.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace strobe::gltf {

/// What the check finds out besides errors.
struct JsonFacts {
    std::vector<std::string> ignoredExtensions; ///< used, not required, and not known here
    std::map<std::string, uint64_t>
        bufferFiles; ///< decoded relative names of external buffers, with their bytes
};

/// How the check fails: throws, given a place in the file (may be empty) and a message.
using JsonFail = std::function<void(const std::string& place, const std::string& message)>;

/// Checks that the text is JSON, not too deep; that numbers fit; that indices and counts are integers from 0;
/// the version; that required extensions are known; that buffers and images are there, and that URIs stay in
/// the file's folder. `chunk`: the size of a .glb file's binary chunk, if it has one.
JsonFacts checkJson(std::string_view text, std::optional<uint64_t> chunk, const JsonFail& fail);

/// A URI's %20 and the like replaced.
std::string decodeUri(const std::string& uri);

} // namespace strobe::gltf
