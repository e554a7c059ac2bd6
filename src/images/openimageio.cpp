// The implementation of core/image/image_library.h with OpenImageIO, which no other room includes. It is
// built as a shared library that exports only the function at the end.
#include "core/image/image_library.h"
#include "images/checked_input.h"
#include "images/decoded_input.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/texture.h>
#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>

namespace strobe {
namespace {

OIIO::TypeDesc toOiio(StoredType type) {
    switch (type) {
    case StoredType::Byte:
        return OIIO::TypeDesc::UINT8;
    case StoredType::Word:
        return OIIO::TypeDesc::UINT16;
    case StoredType::Half:
        return OIIO::TypeDesc::HALF;
    case StoredType::Float:
        break;
    }
    return OIIO::TypeDesc::FLOAT;
}

StoredType storedType(const OIIO::TypeDesc& type) {
    for (const StoredType stored : {StoredType::Byte, StoredType::Word, StoredType::Half})
        if (type == toOiio(stored))
            return stored;
    return StoredType::Float;
}

bool isUncroppedImage(const OIIO::ImageSpec& spec) {
    return spec.x == 0 && spec.y == 0 && spec.full_x == 0 && spec.full_y == 0 &&
           spec.full_width == spec.width && spec.full_height == spec.height;
}

class OpenedFile final : public ImageReader {
  public:
    /// Returns null on failure; then OIIO::geterror() is the message.
    static std::unique_ptr<ImageReader> open(const std::string& path) {
        auto file = std::make_unique<OpenedFile>();
        return file->init(OIIO::ImageInput::open(path)) ? std::move(file) : nullptr;
    }
    static std::unique_ptr<ImageReader> open(std::span<const unsigned char> encoded) {
        auto file = std::make_unique<OpenedFile>();
        OIIO::Filesystem::IOProxy& memory = file->m_memory.emplace(encoded.data(), encoded.size());
        OIIO::ImageSpec config;
        config.attribute("oiio:UnassociatedAlpha", 1);
        void* proxy = &memory; // OpenImageIO 2.4 ignores the argument of `open` if there is a configuration
        config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
        const bool isJpeg = encoded.size() > 2 && encoded[0] == 0xff && encoded[1] == 0xd8;
        return file->init(OIIO::ImageInput::open(isJpeg ? "memory.jpg" : "memory.png", &config, &memory))
                   ? std::move(file)
                   : nullptr;
    }

    bool read(int first, int last, float* out, std::string& error) override {
        const bool isRead = m_input->read_image(0, 0, first, last, OIIO::TypeDesc::FLOAT, out);
        error = isRead ? hiddenError(*m_input) : m_input->geterror();
        return isRead && error.empty();
    }
    V2i levelSize(int level) override {
        const OIIO::ImageSpec spec = m_input->spec_dimensions(0, level);
        return {spec.width, spec.height};
    }
    bool readLevel(int level, int first, int last, StoredType type, std::byte* out,
                   std::string& error) override {
        const bool isRead = m_input->read_image(0, level, first, last, toOiio(type), out);
        error = isRead ? hiddenError(*m_input) : m_input->geterror();
        return isRead && error.empty();
    }
    std::string metadata(const std::string& name) const override {
        const std::string value(m_input->spec().extra_attribs.get_string(name));
        return value.empty() ? describedValue(name) : value;
    }

  private:
    /// Returns the value in a line "name=value" of the description: see addMetadata.
    std::string describedValue(const std::string& name) const {
        std::istringstream lines(std::string(m_input->spec().extra_attribs.get_string("ImageDescription")));
        for (std::string line; std::getline(lines, line);)
            if (line.starts_with(name + '='))
                return line.substr(name.size() + 1);
        return "";
    }
    /// Returns false if `input` is null.
    bool init(std::unique_ptr<OIIO::ImageInput> input) {
        m_input = std::move(input);
        if (!m_input)
            return false;
        m_input->geterror(); // clears the error of an earlier input at this address
        const OIIO::ImageSpec& spec = m_input->spec();
        width = spec.width;
        height = spec.height;
        depth = spec.depth;
        channels = spec.nchannels;
        alphaChannel = spec.alpha_channel;
        isFloat = spec.format.is_floating_point();
        stored = storedType(spec.format);
        isTiled = spec.tile_width != 0;
        isUncropped = isUncroppedImage(spec);
        return true;
    }

    std::optional<OIIO::Filesystem::IOMemReader> m_memory; ///< outlives the input
    std::unique_ptr<OIIO::ImageInput> m_input;
};

OIIO::TextureOpt::Wrap toOiio(Wrap wrap) {
    switch (wrap) {
    case Wrap::Repeat:
        return OIIO::TextureOpt::WrapPeriodic;
    case Wrap::Black:
        return OIIO::TextureOpt::WrapBlack;
    case Wrap::Mirror:
        return OIIO::TextureOpt::WrapMirror;
    case Wrap::Clamp:
        break;
    }
    return OIIO::TextureOpt::WrapClamp;
}

/// OIIO's texture system and its image cache.
class OiioSystem {
  public:
    explicit OiioSystem(int megabytes) : images(OIIO::ImageCache::create(false)) {
        images->attribute("max_memory_MB", float(megabytes));
        images->attribute("autotile", 64);
        images->attribute("automip", 1);
        images->attribute("accept_untiled", 1);
        images->attribute("accept_unmipped", 1);
        textures = OIIO::TextureSystem::create(false, images);
    }
    ~OiioSystem() {
        for (OIIO::TextureSystem::Perthread* info : m_threads)
            textures->destroy_thread_info(info);
        OIIO::TextureSystem::destroy(textures, false);
        OIIO::ImageCache::destroy(images, false);
    }
    OiioSystem(const OiioSystem&) = delete;
    OiioSystem& operator=(const OiioSystem&) = delete;

    /// Returns the per-thread data of the calling thread. OIIO would manage them itself, but identifies a
    /// cache by its address: a thread that outlives a cache would use the deleted data for a new cache at the
    /// same address.
    OIIO::TextureSystem::Perthread* threadInfo() {
        bool exists = false;
        OIIO::TextureSystem::Perthread*& info = m_threads.local(exists);
        if (!exists)
            info = textures->create_thread_info();
        return info;
    }

    OIIO::ImageCache* images;
    OIIO::TextureSystem* textures;

  private:
    tbb::enumerable_thread_specific<OIIO::TextureSystem::Perthread*> m_threads;
};

class OpenedTexture final : public TextureHandle {
  public:
    OpenedTexture(OiioSystem& system, OIIO::TextureSystem::TextureHandle* handle,
                  OIIO::ImageCache::ImageHandle* image, const OIIO::ImageSpec& spec)
        : m_system(system), m_handle(handle), m_image(image) {
        width = spec.width;
        height = spec.height;
        channels = spec.nchannels;
        isTiled = spec.tile_width != 0;
        isUncropped = isUncroppedImage(spec);
    }

    bool readLevels(int n, std::vector<DecodedImage>& out, std::string& error) const override {
        OIIO::ImageCache& images = *m_system.images;
        // Uses its own per-thread data: data that OIIO creates would keep tiles after the end of the cache.
        const auto destroy = [&](OIIO::ImageCache::Perthread* info) { images.destroy_thread_info(info); };
        const std::unique_ptr<OIIO::ImageCache::Perthread, decltype(destroy)> thread(
            images.create_thread_info(), destroy);
        OIIO::ImageSpec spec;
        for (int level = 0; images.get_imagespec(m_image, thread.get(), spec, 0, level); ++level) {
            DecodedImage image{spec.width, spec.height, n, {}};
            image.values.resize(size_t(spec.width) * size_t(spec.height) * size_t(n));
            if (!images.get_pixels(m_image, thread.get(), 0, level, 0, spec.width, 0, spec.height, 0, 1, 0, n,
                                   OIIO::TypeDesc::FLOAT, image.values.data())) {
                error = images.geterror();
                return false;
            }
            out.push_back(std::move(image));
            if (spec.width == 1 && spec.height == 1)
                break;
        }
        images.geterror(); // clears the error about the missing level after the last one
        return !out.empty();
    }

    bool lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, const TextureOptions& requested, int n,
                float* out, std::string& error) const override {
        OIIO::TextureOpt options;
        options.swrap = toOiio(requested.u);
        options.twrap = toOiio(requested.v);
        options.interpmode = requested.nearest
                                 ? OIIO::TextureOpt::InterpClosest
                                 : OIIO::TextureOpt::InterpBilinear; // bicubic interpolation overshoots
        const bool isPoint = duvdx == V2f(0) && duvdy == V2f(0);
        options.mipmode = isPoint ? OIIO::TextureOpt::MipModeNoMIP : OIIO::TextureOpt::MipModeAniso;
        OIIO::TextureSystem& textures = *m_system.textures;
        if (textures.texture(m_handle, m_system.threadInfo(), options, uv.x, uv.y, duvdx.x, duvdx.y, duvdy.x,
                             duvdy.y, n, out))
            return true;
        error = textures.geterror();
        return false;
    }

  private:
    OiioSystem& m_system;
    OIIO::TextureSystem::TextureHandle* m_handle;
    OIIO::ImageCache::ImageHandle* m_image;
};

class Textures final : public TextureSystem {
  public:
    explicit Textures(int megabytes) : m_system(megabytes) {}

    void addImage(const std::string& name, Decode decode) override {
        const std::lock_guard lock(m_mutex);
        const Decode& stored = m_decodes.try_emplace(name, std::move(decode)).first->second;
        OIIO::ImageSpec config;
        DecodedInput::setDecode(config, stored);
        m_system.images->add_file(OIIO::ustring(name), DecodedInput::create, &config);
    }
    std::unique_ptr<const TextureHandle> open(const std::string& path, std::string& error) override {
        const OIIO::ustring name(path);
        checkReadsOf(path);
        OIIO::TextureSystem& textures = *m_system.textures;
        OIIO::TextureSystem::TextureHandle* handle = textures.get_texture_handle(name, m_system.threadInfo());
        OIIO::ImageSpec spec;
        if (!textures.get_imagespec(handle, m_system.threadInfo(), 0, spec)) {
            error = textures.geterror();
            return nullptr;
        }
        if (spec.tile_width != 0) // with its MIP levels
            m_tileBytesKnown.fetch_add(spec.image_bytes() * 4 / 3, std::memory_order_relaxed);
        return std::make_unique<OpenedTexture>(m_system, handle, m_system.images->get_image_handle(name),
                                               spec);
    }

    TileCounts counts() const override {
        return {m_tileBytesRead.load(std::memory_order_relaxed),
                m_tileBytesKnown.load(std::memory_order_relaxed)};
    }

  private:
    /// Makes the cache read the file through CheckedInput. Does nothing for images in memory, and for names
    /// that OpenImageIO expands to several files.
    void checkReadsOf(const std::string& path) {
        const std::lock_guard lock(m_mutex);
        if (std::error_code ignored; m_decodes.contains(path) ||
                                     !std::filesystem::is_regular_file(path, ignored) ||
                                     !m_checked.insert(path).second)
            return;
        OIIO::ImageSpec config;
        CheckedInput::setCounter(config, m_tileBytesRead);
        m_system.images->add_file(OIIO::ustring(path), CheckedInput::create, &config);
    }

    std::atomic<uint64_t> m_tileBytesRead{0}, m_tileBytesKnown{0};
    std::mutex m_mutex;
    std::map<std::string, Decode> m_decodes; ///< by name; OIIO calls them on demand
    std::set<std::string> m_checked;         ///< names passed to CheckedInput
    OiioSystem m_system;
};

class OpenImageIo final : public ImageLibrary {
  public:
    void readByExtensionOnly() const override { OIIO::attribute("try_all_readers", 0); }
    std::unique_ptr<ImageReader> open(const std::string& path, std::string& error) const override {
        return orError(OpenedFile::open(path), error);
    }
    std::unique_ptr<ImageReader> open(std::span<const unsigned char> encoded,
                                      std::string& error) const override {
        return orError(OpenedFile::open(encoded), error);
    }

    std::vector<unsigned char> encode(ImageFormat format, const StoredPixels& pixels, bool isSrgb,
                                      const Metadata& metadata, std::string& error) const override {
        const auto [type, data] = std::visit(
            [](const auto& values) {
                using Value = typename std::decay_t<decltype(values)>::value_type;
                return std::pair<OIIO::TypeDesc, const void*>(OIIO::BaseTypeFromC<Value>::value,
                                                              values.data());
            },
            pixels.values);
        OIIO::ImageSpec spec(pixels.width, pixels.height, pixels.channels, type);
        spec.attribute("oiio:UnassociatedAlpha", 1);
        // OpenImageIO 2.4 would write the color space of a TIFF to another directory, and lose the first one.
        if (isSrgb && format != ImageFormat::Tiff)
            spec.attribute("oiio:ColorSpace", "sRGB");
        addMetadata(spec, format, metadata);
        const std::string name = nameOf(format);
        std::vector<unsigned char> encoded;
        OIIO::Filesystem::IOVecOutput memory(encoded);
        const auto output = OIIO::ImageOutput::create(name, &memory);
        if (!output || !output->open("image." + name, spec) || !output->write_image(type, data) ||
            !output->close()) {
            error = output ? output->geterror() : OIIO::geterror();
            encoded.clear();
        }
        return encoded;
    }

    std::unique_ptr<TextureSystem> makeTextureSystem(int megabytes) const override {
        return std::make_unique<Textures>(megabytes);
    }

  private:
    static std::string nameOf(ImageFormat format) {
        return format == ImageFormat::Jpeg   ? "jpg"
               : format == ImageFormat::Tiff ? "tif"
               : format == ImageFormat::Hdr  ? "hdr"
                                             : "png";
    }
    /// Adds the metadata as they are where the format has names for all of them, else as lines of the
    /// description.
    static void addMetadata(OIIO::ImageSpec& spec, ImageFormat format, const Metadata& metadata) {
        std::string lines;
        for (const auto& [name, value] : metadata)
            std::visit(
                [&, &key = name](const auto& v) {
                    if constexpr (std::is_same_v<std::decay_t<decltype(v)>, M44f>)
                        return;
                    else if (format == ImageFormat::Png || key == "Software")
                        spec.attribute(key, v);
                    else
                        lines += OIIO::Strutil::fmt::format("{}{}={}", lines.empty() ? "" : "\n", key, v);
                },
                value);
        if (!lines.empty())
            spec.attribute("ImageDescription", lines);
        if (format == ImageFormat::Tiff)
            spec.attribute("compression", "zip");
        if (format == ImageFormat::Jpeg)
            spec.attribute("Compression", "jpeg:95");
    }

    /// Returns `file`; if it is null, sets `error`.
    static std::unique_ptr<ImageReader> orError(std::unique_ptr<ImageReader> file, std::string& error) {
        if (!file)
            error = OIIO::geterror();
        return file;
    }
};

} // namespace
} // namespace strobe

extern "C" __attribute__((visibility("default"))) const strobe::ImageLibrary* strobeImageLibrary() {
    static const strobe::OpenImageIo library;
    return &library;
}
