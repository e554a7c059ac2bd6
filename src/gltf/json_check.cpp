#include "gltf/json_check.h"

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

/// The deepest legitimate member stands at about 10; extras are anybody's.
constexpr int kMaxDepth = 128;

const std::set<std::string>& knownExtensions() {
    static const std::set<std::string> names{
        "KHR_lights_punctual", "KHR_materials_clearcoat", "KHR_materials_emissive_strength",
        "KHR_materials_ior",   "KHR_materials_specular",  "KHR_materials_transmission",
        "KHR_materials_unlit", "KHR_mesh_quantization",   "KHR_texture_transform"};
    return names;
}

/// What some of the unknown ones are, and what can be done.
std::string hintOf(const std::string& extension) {
    static const std::map<std::string, const char*> hints{
        {"KHR_draco_mesh_compression",
         "the meshes are compressed by Draco; export without compression, or decompress them first"},
        {"EXT_meshopt_compression",
         "the buffers are compressed by meshoptimizer (gltfpack -c); export without compression"},
        {"KHR_meshopt_compression",
         "the buffers are compressed by meshoptimizer; export without compression"},
        {"KHR_texture_basisu", "the textures are Basis Universal (KTX2) files; export them as PNG or JPEG"},
        {"EXT_texture_webp", "the textures are WebP files; export them as PNG or JPEG"},
        {"EXT_mesh_gpu_instancing", "instances by attribute; export them as nodes"},
        {"KHR_materials_pbrSpecularGlossiness", "materials of glTF 1; convert them to metallic-roughness"}};
    const auto it = hints.find(extension);
    return it == hints.end() ? "" : std::string(": ") + it->second;
}

/// Members that hold an index, a count, a number of bytes or an enumeration, wherever they stand.
bool isInteger(const std::string& name) {
    static const std::set<std::string> names{
        "buffer",        "bufferView", "byteLength", "byteOffset", "byteStride", "camera",
        "componentType", "count",      "index",      "indices",    "input",      "inverseBindMatrices",
        "light",         "magFilter",  "material",   "mesh",       "minFilter",  "mode",
        "node",          "output",     "sampler",    "scene",      "skeleton",   "skin",
        "source",        "texCoord",   "wrapS",      "wrapT"};
    return names.count(name) != 0;
}

/// Arrays of indices.
bool isIntegerList(const std::string& name) {
    return name == "nodes" || name == "children" || name == "joints";
}

class Checker {
  public:
    explicit Checker(const JsonFail& fail) : m_fail(fail) {}

    JsonFacts check(std::string_view text, std::optional<uint64_t> chunk) {
        const json root = parse(text);
        if (!root.is_object())
            m_fail("", "the file's JSON is not an object");
        checkVersion(root);
        checkExtensions(root);
        checkSources(root, chunk);
        checkMembers(root, "");
        return std::move(m_facts);
    }

  private:
    json parse(std::string_view text) {
        const auto watch = [&](int depth, json::parse_event_t, json&) {
            if (depth > kMaxDepth)
                m_fail("", "the JSON is nested more than " + std::to_string(kMaxDepth) + " deep");
            return true;
        };
        try {
            return json::parse(text, watch);
        } catch (const json::exception& e) { // "[json.exception.…] what is wrong": without the bracket
            const std::string what = e.what();
            const size_t end = what.find("] ");
            m_fail("", "this is not valid JSON: " + (end == std::string::npos ? what : what.substr(end + 2)));
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
            m_fail(list, "must be a list of strings");
        for (const json& name : *it) {
            if (!name.is_string())
                m_fail(list, "must be a list of strings");
            out.push_back(name);
        }
        return out;
    }

    void checkExtensions(const json& root) {
        std::string missing;
        for (const std::string& name : strings(root, "extensionsRequired"))
            if (!knownExtensions().count(name))
                missing += (missing.empty() ? "" : "; ") + name + hintOf(name);
        if (!missing.empty())
            m_fail("extensionsRequired", "the file needs what is not supported: " + missing);
        for (const std::string& name : strings(root, "extensionsUsed"))
            if (!knownExtensions().count(name))
                m_facts.ignoredExtensions.push_back(name + hintOf(name));
    }

    /// Calls check(entry, place) for the objects of a list.
    template <class Check>
    void forEach(const json& root, const char* list, const Check& check) {
        const auto it = root.find(list);
        if (it == root.end())
            return;
        if (!it->is_array())
            m_fail(list, "must be a list");
        for (size_t i = 0; i < it->size(); ++i) {
            const std::string place = std::string(list) + "[" + std::to_string(i) + "]";
            if (!(*it)[i].is_object())
                m_fail(place, "must be an object");
            check((*it)[i], place);
        }
    }

    /// The entry's URI; nothing when it has none.
    std::optional<std::string> uriOf(const json& entry, const std::string& place) {
        const auto uri = entry.find("uri");
        if (uri == entry.end())
            return std::nullopt;
        if (!uri->is_string())
            m_fail(place + ".uri", "must be a string");
        const std::string name = *uri;
        if (!isData(name))
            checkFileName(decodeUri(name), place + ".uri");
        return name;
    }
    static bool isData(const std::string& uri) { return uri.compare(0, 5, "data:") == 0; }

    /// How many bytes a data URI holds.
    uint64_t checkData(const std::string& uri, const std::string& place) {
        const size_t comma = uri.find(";base64,");
        if (comma == std::string::npos)
            m_fail(place, "is a data URI of an unknown kind: only base64 is known");
        std::string_view digits = std::string_view(uri).substr(comma + 8);
        const size_t padded = digits.size();
        while (!digits.empty() && digits.back() == '=')
            digits.remove_suffix(1);
        const auto isDigit = [](unsigned char c) { return std::isalnum(c) || c == '+' || c == '/'; };
        if (padded - digits.size() > 2 || digits.size() % 4 == 1 ||
            !std::all_of(digits.begin(), digits.end(), isDigit))
            m_fail(place, "is not base64");
        return digits.size() * 3 / 4;
    }

    void checkBuffer(const json& buffer, const std::string& place, std::optional<uint64_t> chunk) {
        const auto length = buffer.find("byteLength");
        if (length == buffer.end())
            m_fail(place + ".byteLength", "is missing");
        checkInteger(*length, place + ".byteLength");
        const uint64_t wanted = *length;
        const auto uri = uriOf(buffer, place);
        if (!uri && !chunk)
            m_fail(place, "has no uri, and the file no binary chunk");
        if (uri && !isData(*uri)) {
            uint64_t& longest = m_facts.bufferFiles[decodeUri(*uri)];
            longest = std::max(longest, wanted);
            return;
        }
        const uint64_t there = uri ? checkData(*uri, place + ".uri") : *chunk;
        if (wanted > there || (uri && wanted != there))
            m_fail(place + ".byteLength",
                   std::to_string(wanted) + " bytes, where there are " + std::to_string(there));
    }

    void checkImage(const json& image, const std::string& place, size_t views) {
        const auto uri = uriOf(image, place);
        const auto view = image.find("bufferView");
        if (!uri == (view == image.end()))
            m_fail(place, "needs a uri or a bufferView, and not both");
        if (uri && isData(*uri) && checkData(*uri, place + ".uri") == 0)
            m_fail(place + ".uri", "is empty");
        if (view == image.end())
            return;
        checkInteger(*view, place + ".bufferView");
        if (view->get<uint64_t>() >= views)
            m_fail(place + ".bufferView",
                   "there is no bufferView " + view->dump() + ": the file has " + std::to_string(views));
    }

    void checkSources(const json& root, std::optional<uint64_t> chunk) {
        forEach(root, "buffers",
                [&](const json& buffer, const std::string& place) { checkBuffer(buffer, place, chunk); });
        size_t views = 0;
        forEach(root, "bufferViews", [&](const json& view, const std::string& place) {
            const auto stride = view.find("byteStride");
            if (stride != view.end() &&
                (checkInteger(*stride, place + ".byteStride"), *stride > 252 || stride->get<int>() % 4 != 0))
                m_fail(place + ".byteStride", stride->dump() + " is not a multiple of 4 up to 252");
            ++views;
        });
        forEach(root, "images",
                [&](const json& image, const std::string& place) { checkImage(image, place, views); });
    }

    /// Strangers' files read nothing but what lies beside them.
    void checkFileName(const std::string& name, const std::string& place) {
        const std::filesystem::path path(name);
        if (name.empty())
            m_fail(place, "is empty");
        if (name.find('\0') != std::string::npos || name.find("://") != std::string::npos)
            m_fail(place, "is not the name of a file");
        const std::filesystem::path normal = path.lexically_normal();
        if (path.is_absolute() || (!normal.empty() && *normal.begin() == ".."))
            m_fail(place, "\"" + name + "\" leads out of the file's folder");
    }

    void checkMembers(const json& value, const std::string& place) {
        if (value.is_array()) {
            for (size_t i = 0; i < value.size(); ++i)
                checkMember(value[i], "", place + "[" + std::to_string(i) + "]");
            return;
        }
        for (const auto& [name, member] : value.items()) {
            const bool isCompat = place.ends_with("extensions") && !knownExtensions().count(name);
            if (name == "extras" || name == "min" || name == "max" || isCompat)
                continue; // not read
            checkMember(member, name, place.empty() ? name : place + "." + name);
        }
    }

    void checkMember(const json& value, const std::string& name, const std::string& place) {
        // "indices" is an object in sparse accessors, "camera" and "light" may be ones of extensions.
        if (isInteger(name) && !value.is_structured())
            checkInteger(value, place);
        const bool isTop = place == name; // the list of nodes itself
        if (isIntegerList(name) && value.is_array() && !isTop)
            for (size_t i = 0; i < value.size(); ++i)
                checkInteger(value[i], place + "[" + std::to_string(i) + "]");
        if (name == "attributes" || place.ends_with(']'))
            checkAttributes(value, place, name);
        if (value.is_number() && !(std::abs(value.get<double>()) <= kLargest))
            m_fail(place, "the number does not fit a 32-bit float");
        if (value.is_structured())
            checkMembers(value, place);
    }

    /// Names of attributes are free, their values are indices.
    void checkAttributes(const json& value, const std::string& place, const std::string& name) {
        if (!value.is_object() || (name != "attributes" && place.find(".targets[") == std::string::npos))
            return;
        for (const auto& [attribute, accessor] : value.items())
            checkInteger(accessor, place + "." + attribute);
    }

    void checkInteger(const json& value, const std::string& place) {
        if (!value.is_number_integer()) // one too large for 64 bits is read as a float
            m_fail(place, value.is_number() && std::abs(value.get<double>()) > 1e18 ? "is out of range"
                                                                                    : "must be an integer");
        // Sizes are as large as files may be; but those of sparse accessors tinygltf keeps in an int.
        const bool isSize =
            place.ends_with("count") || place.ends_with("byteLength") || place.ends_with("byteOffset");
        const uint64_t most =
            isSize && place.find(".sparse.") == std::string::npos ? kLargestSize : kLargestInt;
        const bool fits = value.is_number_unsigned() && value.get<uint64_t>() <= most;
        if (!fits)
            m_fail(place, value.dump() + " is out of range");
    }

    static constexpr double kLargest = std::numeric_limits<float>::max();
    static constexpr uint64_t kLargestInt = std::numeric_limits<int>::max(), kLargestSize = uint64_t(1) << 32;
    const JsonFail& m_fail;
    JsonFacts m_facts;
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

JsonFacts checkJson(std::string_view text, std::optional<uint64_t> chunk, const JsonFail& fail) {
    return Checker(fail).check(text, chunk);
}

} // namespace strobe::gltf
