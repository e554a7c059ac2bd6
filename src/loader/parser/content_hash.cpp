#include "loader/parser/content_hash.h"

#include "core/math/hash.h"

#include <cstring>
#include <fstream>
#include <map>

namespace strobe {

uint64_t textHash(std::string_view text) {
    uint64_t hash = hashOf(text.size());
    while (!text.empty()) {
        const size_t bytes = std::min<size_t>(8, text.size());
        uint64_t word = 0;
        std::memcpy(&word, text.data(), bytes);
        hash = hashCombine(hash, word);
        text.remove_prefix(bytes);
    }
    return hash;
}

namespace {

/// Returns a hash of a file; none if it cannot be read.
std::optional<uint64_t> fileHash(const std::filesystem::path& path) {
    constexpr uintmax_t kMaxContent = 64 << 20;
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error))
        return std::nullopt;
    const auto size = std::filesystem::file_size(path, error);
    const auto time = std::filesystem::last_write_time(path, error);
    if (error)
        return std::nullopt;
    if (size > kMaxContent)
        return hashOf(size, time.time_since_epoch().count());
    std::ifstream stream(path, std::ios::binary);
    std::string bytes(size, 0);
    stream.read(bytes.data(), std::streamsize(size));
    return stream ? std::optional(textHash(bytes)) : std::nullopt;
}

class ContentHash {
  public:
    /// `folder`: of the scene; names of files are relative to it.
    explicit ContentHash(std::filesystem::path folder) : m_folder(std::move(folder)) {}
    void add(const std::string& name, uint64_t hash) { m_hashes[name] = hash; }
    std::string nameOf(const std::filesystem::path& path) const {
        const std::filesystem::path relative = path.lexically_relative(m_folder);
        return (relative.empty() ? path : relative).string();
    }
    void addFile(const std::filesystem::path& path) {
        const std::string name = nameOf(path);
        if (m_hashes.contains(name))
            return;
        if (const auto hash = fileHash(path))
            add(name, *hash);
    }
    /// Adds every string that is the name of an existing file: without the plugin tables, file names cannot
    /// be told from other strings.
    void add(const ParamSet& params) {
        for (const Param& param : params.all())
            for (const std::string& name : param.strings)
                try {
                    addFile(resolveFile(name, param.where));
                } catch (const Error&) {
                }
    }
    void add(const ObjectDecl& object) {
        for (const ShapeDecl& shape : object.shapes)
            add(shape.shape.params);
    }
    SceneContent content() const {
        SceneContent content;
        for (const auto& [name, hash] : m_hashes) {
            content.hash = hashCombine(content.hash, hash);
            if (content.files.size() < SceneContent::kMaxFiles)
                content.files.emplace_back(name, hash);
        }
        return content;
    }

  private:
    std::filesystem::path m_folder;
    std::map<std::string, uint64_t> m_hashes;
};

} // namespace

SceneContent contentOf(const SceneDescription& description,
                       const std::vector<std::pair<std::string, uint64_t>>& others) {
    ContentHash content(description.sources.empty() ? std::filesystem::path()
                                                    : description.sources.front()->path.parent_path());
    for (const auto& [name, hash] : others)
        content.add(name, hash);
    for (const auto& source : description.sources)
        content.add(content.nameOf(source->path), textHash(source->text));
    for (const auto& [name, value] : description.values)
        content.add("$" + name, textHash(value));
    for (const TextureDecl& texture : description.textures)
        content.add(texture.texture.params);
    for (const MaterialDecl& material : description.materials)
        content.add(material.material.params);
    for (const AreaLightDecl& light : description.areaLights)
        content.add(light.light.params);
    for (const LightDecl& light : description.lights)
        content.add(light.light.params);
    for (const ObjectDecl& object : description.objects)
        content.add(object);
    content.add(description.world);
    for (const GltfDecl& file : description.gltfs)
        for (const std::filesystem::path& path : gltf::filesOf(*file.document))
            content.addFile(path);
    return content.content();
}

} // namespace strobe
