#include "loader/parser/content_hash.h"

#include "core/math/hash.h"

#include <cstring>

namespace strobe {
namespace {

uint64_t hashOfText(std::string_view text) {
    uint64_t h = hashOf(text.size());
    for (; !text.empty(); text.remove_prefix(std::min<size_t>(8, text.size()))) {
        uint64_t word = 0;
        std::memcpy(&word, text.data(), std::min<size_t>(8, text.size()));
        h = hashCombine(h, word);
    }
    return h;
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
    /// Any string may be the name of a file: whether it is one, the disk knows.
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

uint64_t contentHash(const SceneDescription& d) {
    ContentHash hash;
    for (const auto& source : d.sources)
        hash.add(hashOfText(source->text));
    for (const TextureDecl& texture : d.textures)
        hash.add(texture.texture.params);
    for (const MaterialDecl& material : d.materials)
        hash.add(material.material.params);
    for (const AreaLightDecl& light : d.areaLights)
        hash.add(light.light.params);
    for (const LightDecl& light : d.lights)
        hash.add(light.light.params);
    for (const ObjectDecl& object : d.objects)
        hash.add(object);
    hash.add(d.world);
    for (const GltfDecl& file : d.gltfs)
        for (const std::filesystem::path& path : gltf::filesOf(*file.document))
            hash.addFile(path);
    return hash.value();
}

} // namespace strobe
