#include "loader/parser/content_hash.h"

#include "core/math/hash.h"

#include <cstring>

namespace strobe {
namespace {

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

class ContentHash {
  public:
    void add(uint64_t number) { m_hash = hashCombine(m_hash, number); }
    void addFile(const std::filesystem::path& path) {
        std::error_code error;
        const auto size = std::filesystem::file_size(path, error);
        const auto time = std::filesystem::last_write_time(path, error);
        if (!error)
            add(hashOf(size, time.time_since_epoch().count()));
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
    uint64_t value() const { return m_hash; }

  private:
    uint64_t m_hash = 0;
};

} // namespace

uint64_t contentHash(const SceneDescription& description) {
    ContentHash hash;
    for (const auto& source : description.sources)
        hash.add(textHash(source->text));
    for (const TextureDecl& texture : description.textures)
        hash.add(texture.texture.params);
    for (const MaterialDecl& material : description.materials)
        hash.add(material.material.params);
    for (const AreaLightDecl& light : description.areaLights)
        hash.add(light.light.params);
    for (const LightDecl& light : description.lights)
        hash.add(light.light.params);
    for (const ObjectDecl& object : description.objects)
        hash.add(object);
    hash.add(description.world);
    for (const GltfDecl& file : description.gltfs)
        for (const std::filesystem::path& path : gltf::filesOf(*file.document))
            hash.addFile(path);
    return hash.value();
}

} // namespace strobe
