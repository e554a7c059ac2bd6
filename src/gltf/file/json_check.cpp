#include "gltf/file/json_check.h"

#include "gltf/file/conformance.h"
#include "gltf/file/json_repair.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

namespace strobe::gltf {
namespace {

using nlohmann::json;

/// The members of glTF are nested about 10 deep; `extras` may be deeper.
constexpr int kMaxDepth = 128;

const std::set<std::string>& knownExtensions() {
    static const std::set<std::string> names{"EXT_mesh_gpu_instancing",    "KHR_materials_anisotropy",
                                             "KHR_materials_iridescence",  "KHR_materials_sheen",
                                             "KHR_materials_volume",       "KHR_lights_punctual",
                                             "KHR_materials_clearcoat",    "KHR_materials_emissive_strength",
                                             "KHR_materials_ior",          "KHR_materials_specular",
                                             "KHR_materials_transmission", "KHR_materials_unlit",
                                             "KHR_mesh_quantization",      "KHR_texture_transform"};
    return names;
}

/// Returns ": " and advice for some unsupported extensions; empty: none.
std::string hintOf(const std::string& extension) {
    static const std::map<std::string, const char*> hints{
        {"KHR_draco_mesh_compression",
         "the meshes are compressed by Draco; export without compression, or decompress them first"},
        {"EXT_meshopt_compression",
         "the buffers are compressed by meshoptimizer (gltfpack -c); export without compression"},
        {"KHR_meshopt_compression",
         "the buffers are compressed by meshoptimizer; export without compression"},
        {"KHR_texture_basisu", "the textures are KTX2 files (Basis Universal); export them as PNG or JPEG"},
        {"EXT_texture_webp", "the textures are WebP files; export them as PNG or JPEG"},
        {"KHR_materials_pbrSpecularGlossiness", "materials of glTF 1; convert them to metallic-roughness"}};
    const auto it = hints.find(extension);
    return it == hints.end() ? "" : std::string(": ") + it->second;
}

/// Returns whether a file can be shown without an extension that it requires: its materials have a fallback,
/// or it adds data or motion only.
bool isOptional(const std::string& extension) {
    static const std::set<std::string> others{
        "KHR_animation_pointer",  "KHR_node_visibility", "KHR_node_hoverability",
        "KHR_node_selectability", "KHR_interactivity",   "KHR_xmp",
        "KHR_xmp_json_ld",        "KHR_audio",           "KHR_physics_rigid_bodies"};
    return extension.find("_materials_") != std::string::npos || others.count(extension) != 0;
}

/// Returns true for members that are an index, a count, a number of bytes or an enumeration in any object.
bool isInteger(const std::string& name) {
    static const std::set<std::string> names{
        "buffer",        "bufferView", "byteLength", "byteOffset", "byteStride", "camera",
        "componentType", "count",      "index",      "indices",    "input",      "inverseBindMatrices",
        "light",         "magFilter",  "material",   "mesh",       "minFilter",  "mode",
        "node",          "output",     "sampler",    "scene",      "skeleton",   "skin",
        "source",        "texCoord",   "wrapS",      "wrapT"};
    return names.count(name) != 0;
}

/// Returns true for members that are arrays of indices.
bool isIntegerList(const std::string& name) {
    return name == "nodes" || name == "children" || name == "joints";
}

class Checker {
  public:
    Checker(bool isBinary, const JsonFail& fail) : m_isBinary(isBinary), m_fail(fail) {}

    JsonFacts check(std::string_view text, std::optional<uint64_t> chunk) {
        json root = parse(text);
        if (!root.is_object())
            m_fail("", "the file's JSON is not an object");
        checkVersion(root);
        m_facts.deviations = findDeviations(root);
        JsonRepair repair = repairJson(
            root, [](const std::string& member) { return isInteger(member) || isIntegerList(member); });
        m_facts.replaced = std::move(repair.deviations);
        m_facts.unbackedAccessors = std::move(repair.unbacked);
        checkExtensions(root);
        checkSources(root, chunk);
        checkMembers(root, "");
        for (const auto& [index, bytes] : m_newBuffers)
            replaceBuffer(root["buffers"][index], bytes);
        if (repair.isChanged || !m_newBuffers.empty())
            m_facts.replacement = root.dump(-1, ' ', false, json::error_handler_t::replace);
        return std::move(m_facts);
    }

  private:
    json parse(std::string_view text) {
        const auto checkDepth = [&](int depth, json::parse_event_t, json&) {
            if (depth > kMaxDepth)
                m_fail("", "the JSON is nested more than " + std::to_string(kMaxDepth) + " deep");
            return true;
        };
        try {
            return json::parse(text, checkDepth);
        } catch (const json::exception& e) {
            const std::string what = e.what();
            const size_t end = what.find("] "); // of the prefix "[json.exception.…] "
            m_fail("", "invalid JSON: " + (end == std::string::npos ? what : what.substr(end + 2)));
        }
        return {};
    }

    void checkVersion(const json& root) {
        const auto asset = root.find("asset");
        if (asset == root.end() || !asset->is_object() || !asset->contains("version") ||
            !(*asset)["version"].is_string())
            m_fail("asset.version", "is missing: this is not a glTF 2.0 file");
        const std::string version = (*asset)["version"];
        if (version.compare(0, 2, "2.") != 0)
            m_fail("asset.version", "this is glTF " + version + "; only 2.0 is supported");
    }

    std::vector<std::string> strings(const json& root, const char* list) {
        std::vector<std::string> out;
        const auto it = root.find(list);
        if (it == root.end())
            return out;
        if (!it->is_array())
            m_fail(list, "must be an array of strings");
        for (const json& name : *it) {
            if (!name.is_string())
                m_fail(list, "must be an array of strings");
            out.push_back(name);
        }
        return out;
    }

    void checkExtensions(const json& root) {
        std::string missing;
        for (const std::string& name : strings(root, "extensionsRequired"))
            if (isOptional(name) && !knownExtensions().count(name))
                m_facts.optionalRequired.push_back(name + hintOf(name));
            else if (!knownExtensions().count(name))
                missing += (missing.empty() ? "" : "; ") + name + hintOf(name);
        if (!missing.empty())
            m_fail("extensionsRequired", "unsupported extensions: " + missing);
        for (const std::string& name : strings(root, "extensionsUsed"))
            if (const std::string text = name + hintOf(name);
                !knownExtensions().count(name) && !isReported(text))
                m_facts.ignoredExtensions.push_back(text);
    }

    /// Whether an extension is known to be required and dispensable.
    bool isReported(const std::string& text) const {
        const auto& reported = m_facts.optionalRequired;
        return std::find(reported.begin(), reported.end(), text) != reported.end();
    }

    /// Calls check(entry, jsonPath) for the objects of an array.
    template <class Check>
    void forEach(const json& root, const char* list, const Check& check) {
        const auto it = root.find(list);
        if (it == root.end())
            return;
        if (!it->is_array())
            m_fail(list, "must be an array");
        for (size_t i = 0; i < it->size(); ++i) {
            const std::string jsonPath = std::string(list) + "[" + std::to_string(i) + "]";
            if (!(*it)[i].is_object())
                m_fail(jsonPath, "must be an object");
            check((*it)[i], jsonPath);
        }
    }

    /// Returns the URI of an entry; nothing if it has none. Throws if it is no valid file name.
    std::optional<std::string> uriOf(const json& entry, const std::string& jsonPath) {
        const auto uri = entry.find("uri");
        if (uri == entry.end())
            return std::nullopt;
        if (!uri->is_string())
            m_fail(jsonPath + ".uri", "must be a string");
        const std::string name = *uri;
        if (!isData(name))
            checkFileName(decodeUri(name), jsonPath + ".uri");
        return name;
    }
    static bool isData(const std::string& uri) { return uri.compare(0, 5, "data:") == 0; }

    /// Returns the number of bytes of a data URI. Throws if it is not base64.
    uint64_t checkData(const std::string& uri, const std::string& jsonPath) {
        const size_t comma = uri.find(";base64,");
        if (comma == std::string::npos)
            m_fail(jsonPath, "is a data URI of an unsupported kind: only base64 is supported");
        std::string_view digits = std::string_view(uri).substr(comma + 8);
        const size_t padded = digits.size();
        while (!digits.empty() && digits.back() == '=')
            digits.remove_suffix(1);
        const auto isDigit = [](unsigned char c) { return std::isalnum(c) || c == '+' || c == '/'; };
        if (padded - digits.size() > 2 || digits.size() % 4 == 1 ||
            !std::all_of(digits.begin(), digits.end(), isDigit))
            m_fail(jsonPath, "is not base64");
        return digits.size() * 3 / 4;
    }

    /// Returns the reason why a buffer has no data, or an empty text if it has data. A buffer without data is
    /// an error if it is used. A buffer without a uri, which glTF allows, consists of zeros instead.
    std::string whyMissing(const json& buffer, bool isFirst, std::optional<uint64_t> chunk) {
        const auto uri = buffer.find("uri");
        if (uri == buffer.end())
            return isFirst && chunk        ? ""
                   : isFirst && m_isBinary ? kNoChunk
                                           : "has no uri: its bytes are taken as zeros";
        const std::string name = uri->is_string() ? uri->get<std::string>() : "";
        if (isData(name) && name.find(";base64,") == std::string::npos)
            return "is a data URI of an unsupported kind: only base64 is supported";
        return !isData(name) && name.find("://") != std::string::npos ? "is not a file name" : "";
    }

    void checkBuffer(const json& buffer, const std::string& jsonPath, std::optional<uint64_t> chunk) {
        const auto length = buffer.find("byteLength");
        if (length == buffer.end())
            m_fail(jsonPath + ".byteLength", "is missing");
        checkInteger(*length, jsonPath + ".byteLength");
        const uint64_t needed = *length;
        const size_t index = m_bufferCount++;
        if (const std::string reason = whyMissing(buffer, index == 0, chunk); !reason.empty()) {
            const bool isZero = !buffer.contains("uri") && reason != kNoChunk && needed <= kMaxZeros;
            const std::string path = jsonPath + (buffer.contains("uri") ? ".uri" : "");
            (isZero ? m_facts.replaced : m_facts.deviations).emplace_back(path, reason);
            if (!isZero)
                m_facts.missingBuffers[index] = {path, reason};
            m_newBuffers[index] = isZero ? size_t(needed) : 1;
            return;
        }
        const auto uri = uriOf(buffer, jsonPath);
        if (uri && !isData(*uri)) {
            uint64_t& longest = m_facts.bufferFiles[decodeUri(*uri)];
            longest = std::max(longest, needed);
            return;
        }
        const uint64_t size = uri ? checkData(*uri, jsonPath + ".uri") : *chunk;
        if (needed > size || (uri && needed != size))
            m_fail(jsonPath + ".byteLength",
                   "is " + std::to_string(needed) + ", but the data has " + std::to_string(size) + " bytes");
    }

    void checkImage(const json& image, const std::string& jsonPath, size_t views) {
        const auto uri = uriOf(image, jsonPath);
        const auto view = image.find("bufferView");
        if (!uri == (view == image.end()))
            m_fail(jsonPath, "must have either a uri or a bufferView");
        if (uri && isData(*uri) && checkData(*uri, jsonPath + ".uri") == 0)
            m_fail(jsonPath + ".uri", "is empty");
        if (view == image.end())
            return;
        checkInteger(*view, jsonPath + ".bufferView");
        if (view->get<uint64_t>() >= views)
            m_fail(jsonPath + ".bufferView",
                   "there is no bufferView " + view->dump() + "; the file has " + std::to_string(views));
    }

    void checkSources(const json& root, std::optional<uint64_t> chunk) {
        forEach(root, "buffers", [&](const json& buffer, const std::string& jsonPath) {
            checkBuffer(buffer, jsonPath, chunk);
        });
        size_t views = 0;
        forEach(root, "bufferViews", [&](const json& view, const std::string& jsonPath) {
            const auto stride = view.find("byteStride");
            if (stride != view.end() && (checkInteger(*stride, jsonPath + ".byteStride"),
                                         *stride > 252 || stride->get<int>() % 4 != 0))
                m_fail(jsonPath + ".byteStride", stride->dump() + " is not a multiple of 4 up to 252");
            ++views;
        });
        forEach(root, "images",
                [&](const json& image, const std::string& jsonPath) { checkImage(image, jsonPath, views); });
    }

    /// Throws unless the name is a relative path in the file's folder: untrusted files must not read other
    /// files.
    void checkFileName(const std::string& name, const std::string& jsonPath) {
        const std::filesystem::path path(name);
        if (name.empty())
            m_fail(jsonPath, "is empty");
        if (name.find('\0') != std::string::npos || name.find("://") != std::string::npos)
            m_fail(jsonPath, "is not a file name");
        const std::filesystem::path normal = path.lexically_normal();
        if (path.is_absolute() || (!normal.empty() && *normal.begin() == ".."))
            m_fail(jsonPath, "\"" + name + "\" is outside the folder of the file");
    }

    void checkMembers(const json& value, const std::string& jsonPath) {
        if (value.is_array()) {
            for (size_t i = 0; i < value.size(); ++i)
                checkMember(value[i], "", jsonPath + "[" + std::to_string(i) + "]");
            return;
        }
        for (const auto& [name, member] : value.items()) {
            const bool isIgnoredExtension =
                jsonPath.ends_with("extensions") && !knownExtensions().count(name);
            if (name == "extras" || name == "min" || name == "max" || isIgnoredExtension)
                continue; // not read
            checkMember(member, name, jsonPath.empty() ? name : jsonPath + "." + name);
        }
    }

    void checkMember(const json& value, const std::string& name, const std::string& jsonPath) {
        // "indices" is an object in sparse accessors; "camera" and "light" may be objects in extensions.
        if (isInteger(name) && !value.is_structured())
            checkInteger(value, jsonPath);
        const bool isRootList = jsonPath == name; // "nodes" of the root is the array of nodes
        if (isIntegerList(name) && value.is_array() && !isRootList)
            for (size_t i = 0; i < value.size(); ++i)
                checkInteger(value[i], jsonPath + "[" + std::to_string(i) + "]");
        if (name == "attributes" || jsonPath.ends_with(']'))
            checkAttributes(value, jsonPath, name);
        if (value.is_number() && !(std::abs(value.get<double>()) <= kLargestFloat))
            m_fail(jsonPath, "the number does not fit a 32-bit float");
        if (value.is_structured())
            checkMembers(value, jsonPath);
    }

    /// Checks the accessor indices of attributes, whose names are arbitrary.
    void checkAttributes(const json& value, const std::string& jsonPath, const std::string& name) {
        if (!value.is_object() || (name != "attributes" && jsonPath.find(".targets[") == std::string::npos))
            return;
        for (const auto& [attribute, accessor] : value.items())
            checkInteger(accessor, jsonPath + "." + attribute);
    }

    void checkInteger(const json& value, const std::string& jsonPath) {
        if (!value.is_number_integer()) // integers beyond 64 bits are read as floats
            m_fail(jsonPath, value.is_number() && std::abs(value.get<double>()) > 1e18
                                 ? "is out of range"
                                 : "must be an integer");
        // Sizes are limited by the size of files; tinygltf stores those of sparse accessors as int.
        const bool isSize = jsonPath.ends_with("count") || jsonPath.ends_with("byteLength") ||
                            jsonPath.ends_with("byteOffset");
        const uint64_t largest =
            isSize && jsonPath.find(".sparse.") == std::string::npos ? kLargestSize : kLargestInt;
        const bool fits = value.is_number_unsigned() && value.get<uint64_t>() <= largest;
        if (!fits)
            m_fail(jsonPath, value.dump() + " is out of range");
    }

    static constexpr double kLargestFloat = std::numeric_limits<float>::max();
    static constexpr uint64_t kLargestInt = std::numeric_limits<int>::max();
    static constexpr const char* kNoChunk = "has no uri, and the file has no binary chunk";
    static constexpr uint64_t kMaxZeros = uint64_t(1) << 24; ///< bytes of a buffer without data
    static constexpr uint64_t kLargestSize = uint64_t(1) << 32;
    const bool m_isBinary;
    const JsonFail& m_fail;
    JsonFacts m_facts;
    size_t m_bufferCount = 0;
    std::map<size_t, size_t> m_newBuffers; ///< bytes, by index
};

} // namespace

std::string decodeUri(const std::string& uri) {
    const auto digit = [](char c) {
        return c >= '0' && c <= '9'   ? c - '0'
               : c >= 'a' && c <= 'f' ? c - 'a' + 10
               : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                      : -1;
    };
    std::string out;
    for (size_t i = 0; i < uri.size(); ++i) {
        const int high = uri[i] == '%' && i + 2 < uri.size() ? digit(uri[i + 1]) : -1;
        const int low = high >= 0 ? digit(uri[i + 2]) : -1;
        if (low >= 0) {
            out += char(16 * high + low);
            i += 2;
        } else {
            out += uri[i];
        }
    }
    return out;
}

JsonFacts checkJson(std::string_view text, std::optional<uint64_t> chunk, bool isBinary,
                    const JsonFail& fail) {
    return Checker(isBinary, fail).check(text, chunk);
}

} // namespace strobe::gltf
