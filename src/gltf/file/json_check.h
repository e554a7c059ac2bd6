// Checks the JSON of a glTF file for mistakes that tinygltf accepts, ignores silently or crashes on.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace strobe::gltf {

/// Results of the check.
struct JsonFacts {
    std::vector<std::string> ignoredExtensions; ///< used, not required, and not supported
    std::vector<std::string> optionalRequired;  ///< required, not supported, and dispensable
    /// Deviations from the specification that do not prevent reading: JSON paths and messages.
    std::vector<std::pair<std::string, std::string>> deviations;
    std::map<size_t, std::pair<std::string, std::string>> missingBuffers; ///< JSON path and reason, by index
    /// As `deviations`, of what differs in `replacement`.
    std::vector<std::pair<std::string, std::string>> replaced;
    std::vector<size_t>
        unbackedAccessors;   ///< accessors without a buffer view, which have one in `replacement`
    std::string replacement; ///< JSON that tinygltf accepts; empty: that of the file
    std::map<std::string, uint64_t>
        bufferFiles; ///< decoded relative names of external buffers, and their bytes
};

/// Throws, given the JSON path of the mistake (may be empty) and a message.
using JsonFail = std::function<void(const std::string& jsonPath, const std::string& message)>;

/// Checks that the text is JSON of limited depth; that numbers fit 32-bit floats; that indices and counts are
/// non-negative integers; the version; that required extensions are supported; that images have data; and
/// that URIs stay in the file's folder. `isBinary`: the file is a .glb. `chunk`: size of its binary
/// chunk, if it has one.
/// Calls `fail` at the first mistake.
JsonFacts checkJson(std::string_view text, std::optional<uint64_t> chunk, bool isBinary,
                    const JsonFail& fail);

/// Returns a URI with its percent encoding decoded.
std::string decodeUri(const std::string& uri);

} // namespace strobe::gltf
