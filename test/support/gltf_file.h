// Builds small glTF files for tests.
#pragma once

#include "core/math/math.h"

#include <nlohmann/json.hpp>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

namespace strobe::test {

using nlohmann::json;

inline std::string base64(const std::vector<unsigned char>& bytes) {
    static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        uint32_t word = 0;
        for (size_t k = 0; k < 3; ++k)
            word = word << 8 | (i + k < bytes.size() ? bytes[i + k] : 0);
        for (size_t k = 0; k < 4; ++k)
            out += i + k <= bytes.size() ? kDigits[word >> (18 - 6 * k) & 63] : '=';
    }
    return out;
}

enum ComponentType { Byte = 5120, UByte, Short, UShort, UInt = 5125, Float };

/// A glTF file under construction. `root` is its JSON, which tests may change. The buffer becomes a data URI.
class GltfFile {
  public:
    json root = {{"asset", {{"version", "2.0"}}},
                 {"scene", 0},
                 {"scenes", {{{"nodes", json::array()}}}},
                 {"nodes", json::array()},
                 {"meshes", json::array()},
                 {"accessors", json::array()},
                 {"bufferViews", json::array()}};

    /// Appends numbers as an accessor; returns its index.
    template <class T>
    int add(const std::vector<T>& numbers, const char* type, ComponentType component,
            bool normalized = false) {
        const int perElement = type == std::string("SCALAR") ? 1
                               : type == std::string("MAT4") ? 16
                                                             : type[3] - '0';
        root["accessors"].push_back({{"bufferView", addView(numbers)},
                                     {"componentType", int(component)},
                                     {"count", numbers.size() / size_t(perElement)},
                                     {"type", type}});
        json& accessor = root["accessors"].back();
        if (normalized)
            accessor["normalized"] = true;
        for (size_t k = 0; k < size_t(perElement) && !numbers.empty();
             ++k) { // required of positions and times
            T least = numbers[k], greatest = numbers[k];
            for (size_t i = k; i < numbers.size(); i += size_t(perElement)) {
                least = std::min(least, numbers[i]);
                greatest = std::max(greatest, numbers[i]);
            }
            accessor["min"].push_back(least);
            accessor["max"].push_back(greatest);
        }
        return int(root["accessors"].size()) - 1;
    }
    int addFloats(const std::vector<float>& numbers, const char* type) { return add(numbers, type, Float); }
    /// Appends numbers as a buffer view; returns its index.
    template <class T>
    int addView(const std::vector<T>& numbers) {
        m_bytes.resize((m_bytes.size() + 3) / 4 * 4);
        const size_t offset = m_bytes.size();
        const size_t size = numbers.size() * sizeof(T);
        m_bytes.resize(offset + size);
        std::memcpy(m_bytes.data() + offset, numbers.data(), size);
        root["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", size}});
        return int(root["bufferViews"].size()) - 1;
    }
    /// Appends a mesh of one primitive; returns its index.
    int addMesh(const json& primitive) {
        root["meshes"].push_back({{"primitives", {primitive}}});
        return int(root["meshes"].size()) - 1;
    }
    /// Appends the mesh of a triangle (0,0,0) (1,0,0) (0,1,0); returns its index.
    int addTriangle() {
        return addMesh({{"attributes", {{"POSITION", addFloats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3")}}}});
    }
    /// Appends a node, by default to the roots of the scene; returns its index.
    int addNode(const json& node, bool isRoot = true) {
        root["nodes"].push_back(node);
        const int index = int(root["nodes"].size()) - 1;
        if (isRoot)
            root["scenes"][0]["nodes"].push_back(index);
        return index;
    }
    /// Adds a channel, with keys of `values`, to the animation `name`, which is created if needed.
    void animate(const std::string& name, int node, const char* path, const std::vector<float>& times,
                 const std::vector<float>& values, const char* type, const char* interpolation = "LINEAR") {
        auto& animations = root["animations"];
        json* animation = nullptr;
        for (json& a : animations)
            if (a["name"] == name)
                animation = &a;
        if (!animation) {
            animations.push_back({{"name", name}, {"channels", json::array()}, {"samplers", json::array()}});
            animation = &animations.back();
        }
        const int input = addFloats(times, "SCALAR");
        const int output = addFloats(values, type);
        (*animation)["channels"].push_back(
            {{"sampler", (*animation)["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
        (*animation)["samplers"].push_back(
            {{"input", input}, {"output", output}, {"interpolation", interpolation}});
    }

    /// Collects the names of the extensions below a value.
    static void collectExtensions(const json& value, std::set<std::string>& names) {
        for (const auto& [name, member] : value.items()) {
            if (name == "extensions" && member.is_object())
                for (const auto& [extension, ignored] : member.items())
                    names.insert(extension);
            if (name == "extensionsRequired")
                for (const json& extension : member)
                    names.insert(extension.get<std::string>());
            if (member.is_structured())
                collectExtensions(member, names);
        }
    }

    /// Returns the .gltf file.
    std::string text() const {
        json out = root;
        std::set<std::string> used;
        collectExtensions(root, used);
        for (const std::string& name : used)
            if (json& list = out["extensionsUsed"]; std::find(list.begin(), list.end(), name) == list.end())
                list.push_back(name);
        if (!m_bytes.empty() && !out.contains("buffers"))
            out["buffers"] = {{{"byteLength", m_bytes.size()},
                               {"uri", "data:application/octet-stream;base64," + base64(m_bytes)}}};
        return out.dump();
    }
    /// Returns the .glb file.
    std::string binary() const {
        json out = root;
        auto bytes = m_bytes;
        bytes.resize((bytes.size() + 3) / 4 * 4);
        out["buffers"] = {{{"byteLength", bytes.size()}}};
        std::string text = out.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        std::string glb = "glTF";
        const auto word = [&](uint32_t w) { glb.append(reinterpret_cast<const char*>(&w), 4); };
        word(2);
        word(uint32_t(28 + text.size() + bytes.size()));
        word(uint32_t(text.size()));
        glb += "JSON" + text;
        word(uint32_t(bytes.size()));
        glb += std::string("BIN\0", 4) + std::string(bytes.begin(), bytes.end());
        return glb;
    }
    const std::vector<unsigned char>& bytes() const { return m_bytes; }

  private:
    std::vector<unsigned char> m_bytes;
};

/// A folder for the files of one test, which its destructor removes.
class GltfFolder {
  public:
    GltfFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "strobe-gltf-XXXXXX").string();
        if (!mkdtemp(name.data()))
            throw std::runtime_error("mkdtemp");
        m_path = name;
    }
    ~GltfFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(m_path, ignored);
    }
    GltfFolder(const GltfFolder&) = delete;
    GltfFolder& operator=(const GltfFolder&) = delete;
    std::filesystem::path write(const std::string& name, const std::string& bytes) const {
        std::ofstream(m_path / name, std::ios::binary) << bytes;
        return m_path / name;
    }
    const std::filesystem::path& path() const { return m_path; }

  private:
    std::filesystem::path m_path;
};

} // namespace strobe::test
