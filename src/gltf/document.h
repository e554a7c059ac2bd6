// A glTF 2.0 file in memory: read, and checked as far as can be without knowing what is wanted of it.
#pragma once

#include "core/util/diagnostics.h"
#include "core/util/resource_policy.h"

#include <tiny_gltf.h>

#include <filesystem>
#include <string>
#include <vector>

namespace strobe::gltf {

/// A .gltf or .glb file with all of its buffers. Immutable.
class Document {
  public:
    /// Reads the file and its .bin files, which must lie in its folder or below. Images stay encoded: those
    /// of data URIs stand in tinygltf::Image::image. Throws an Error at `where` (who asks for the file) whose
    /// message begins with the file's name and, where it can, the place in its JSON: "a.gltf: nodes[3].mesh:
    /// …".
    Document(const std::filesystem::path& path, const Location& where,
             std::shared_ptr<const ResourcePolicy> guard = nullptr);

    const tinygltf::Model& model() const { return m_model; }
    const std::filesystem::path& path() const { return m_path; }
    /// The file, its .bin files and its image files.
    std::vector<std::filesystem::path> files() const;
    /// Where a relative URI of the file leads: what to open. Throws if it must not be read.
    std::filesystem::path resolve(const std::string& uri) const;
    const Location& where() const { return m_where; }
    /// Extensions that the file uses and can do without, and that are not known here.
    const std::vector<std::string>& ignoredExtensions() const { return m_ignored; }

    /// "FILE: PLACE: MESSAGE" as an Error.
    [[noreturn]] void fail(const std::string& place, const std::string& message) const;
    /// The same as a warning, reported once for each `key`.
    void warnOnce(Diagnostics& messages, const std::string& key, const std::string& place,
                  const std::string& message) const;

    /// items[index]; an Error at `place` when there is no such item. `noun`: of one item.
    template <class T>
    const T& at(const std::vector<T>& items, int index, const char* noun, const std::string& place) const {
        if (index < 0 || size_t(index) >= items.size())
            failIndex(index, items.size(), noun, place);
        return items[size_t(index)];
    }

  private:
    [[noreturn]] void failIndex(int index, size_t count, const char* noun, const std::string& place) const;
    /// The path to open; throws if the guard has something against it.
    std::filesystem::path admitted(const std::filesystem::path& file) const {
        return m_guard ? m_guard->authorizeRead(file, m_where) : file;
    }
    void parse(const std::vector<unsigned char>& bytes);
    std::string text(const std::string& place, const std::string& message) const;

    std::filesystem::path m_path;
    Location m_where;
    std::shared_ptr<const ResourcePolicy> m_guard; ///< or null
    tinygltf::Model m_model;
    std::vector<std::string> m_ignored;
};

/// "nodes[3]".
inline std::string item(const char* list, size_t index) {
    return std::string(list) + "[" + std::to_string(index) + "]";
}

} // namespace strobe::gltf
