// A glTF 2.0 file in memory.
#pragma once

#include "core/util/diagnostics.h"
#include "core/util/resource_policy.h"
#include "gltf/file/conformance.h"

#include <tiny_gltf.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace strobe::gltf {

/// A .gltf or .glb file with all of its buffers. Immutable. Its JSON is checked (see checkJson); indices,
/// accessors and the node tree are checked by their readers.
class Document {
  public:
    /// Reads the file and its .bin files, which must lie in its folder or below. Images stay encoded; those
    /// of data URIs are in tinygltf::Image::image. `where`: location of the reference to the file. `policy`:
    /// which files may be read; null: all. Throws an Error at `where` whose message begins with the file's
    /// name and, if possible, the JSON path: "a.gltf: nodes[3].mesh: …".
    Document(const std::filesystem::path& path, const Location& where,
             std::shared_ptr<const ResourcePolicy> policy = nullptr);

    const tinygltf::Model& model() const { return m_model; }
    const std::filesystem::path& path() const { return m_path; }
    /// Returns the file, its .bin files and its image files.
    std::vector<std::filesystem::path> files() const;
    /// Returns the path to open for a relative URI of the file. Throws an Error if it must not be read.
    std::filesystem::path resolve(const std::string& uri) const;
    const Location& where() const { return m_where; }
    /// Returns the extensions that the file uses, does not require, and that strobe does not support.
    const std::vector<std::string>& ignoredExtensions() const { return m_ignored; }

    /// Throws "FILE: JSONPATH: MESSAGE" as an Error.
    [[noreturn]] void fail(const std::string& jsonPath, const std::string& message) const;
    /// Warns "FILE: JSONPATH: MESSAGE", once for each `key`.
    void warnOnce(Diagnostics& diagnostics, const std::string& key, const std::string& jsonPath,
                  const std::string& message) const;

    /// For a file that does not conform to glTF in a way that viewers accept: throws if `diagnostics` is
    /// strict, else warns as warnOnce.
    void tolerate(Diagnostics& diagnostics, const std::string& key, const std::string& jsonPath,
                  const std::string& message) const;
    /// Tolerates what was replaced: buffers without data and unknown types. To be called before data is read.
    void tolerateReplaced(Diagnostics& diagnostics) const;
    /// Tolerates what was found while the file was read, after the errors of all readers. To be called once.
    void tolerateAll(Diagnostics& diagnostics) const;
    /// Throws if buffer `index` has no data.
    void requireBuffer(size_t index) const;

    /// Returns items[index]. Throws an Error at `jsonPath` if the index is out of range. `noun`: singular of
    /// the items, for the message.
    template <class T>
    const T& at(const std::vector<T>& items, int index, const char* noun, const std::string& jsonPath) const {
        if (index < 0 || size_t(index) >= items.size())
            failIndex(index, items.size(), noun, jsonPath);
        return items[size_t(index)];
    }

  private:
    [[noreturn]] void failIndex(int index, size_t count, const char* noun, const std::string& jsonPath) const;
    /// Returns the path to open. Throws if the policy forbids it.
    std::filesystem::path admitted(const std::filesystem::path& file) const {
        return m_policy ? m_policy->authorizeRead(file, m_where) : file;
    }
    void parse(std::vector<unsigned char> bytes);
    void load(const std::vector<unsigned char>& bytes, const std::map<std::string, uint64_t>& bufferFiles);
    std::string text(const std::string& jsonPath, const std::string& message) const;

    std::filesystem::path m_path;
    Location m_where;
    std::shared_ptr<const ResourcePolicy> m_policy; ///< or null
    tinygltf::Model m_model;
    std::vector<std::string> m_ignored;
    Deviations m_tolerated, m_replaced;
    std::map<size_t, std::pair<std::string, std::string>> m_missingBuffers;
};

/// Returns a JSON path: "nodes[3]".
inline std::string item(const char* list, size_t index) {
    return std::string(list) + "[" + std::to_string(index) + "]";
}

} // namespace strobe::gltf
