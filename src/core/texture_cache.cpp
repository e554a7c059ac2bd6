#include "core/image.h"
#include "core/texture_levels.h"

#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/texture.h>
#include <tbb/enumerable_thread_specific.h>

#include <cstring>
#include <map>
#include <mutex>
#include <optional>

namespace strobe {
namespace {

/// Presents a file to OIIO's cache with its values made linear, so that MIP levels and filters work on light,
/// not on encoded numbers. The whole file is decoded when it is opened.
class LinearizingInput : public OIIO::ImageInput {
  public:
    static OIIO::ImageInput* create() { return new LinearizingInput; }
    const char* format_name() const override { return "strobe-linearized"; }
    bool open(const std::string&, OIIO::ImageSpec&) override { return false; } // needs the configuration

    bool open(const std::string&, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) override {
        const auto file = OIIO::ImageInput::open(config.get_string_attribute("strobe:path"));
        if (!file) {
            errorfmt("{}", OIIO::geterror());
            return false;
        }
        const OIIO::ImageSpec& stored = file->spec();
        const auto& transfer =
            **static_cast<const Transfer* const*>(config.find_attribute("strobe:transfer")->data());
        const int n = stored.nchannels >= 3 ? 3 : 1;
        const size_t texels = size_t(stored.width) * size_t(stored.height);
        m_values.resize(texels * size_t(n));
        if (!file->read_image(0, 0, 0, n, OIIO::TypeDesc::FLOAT, m_values.data())) {
            errorfmt("{}", file->geterror());
            return false;
        }
        const bool isSpace = transfer.kind == Transfer::Space;
        if (isSpace)
            convert(transfer, texels, n);
        else
            for (float& v : m_values)
                v = transfer.linear(v);
        m_spec = OIIO::ImageSpec(stored.width, stored.height, isSpace ? 3 : n, OIIO::TypeDesc::FLOAT);
        spec = m_spec;
        return true;
    }
    bool close() override { return true; }
    bool read_native_scanline(int subimage, int miplevel, int y, int, void* data) override {
        if (subimage != 0 || miplevel != 0 || y < 0 || y >= m_spec.height)
            return false;
        const size_t row = size_t(m_spec.width) * m_spec.nchannels;
        std::memcpy(data, &m_values[size_t(y) * row], row * sizeof(float));
        return true;
    }

  private:
    /// Grey becomes a colour: the space's grey need not be ours.
    void convert(const Transfer& transfer, size_t texels, int channels) {
        std::vector<Rgb> colours(texels);
        for (size_t i = 0; i < texels; ++i)
            colours[i] = channels == 1 ? Rgb(m_values[i])
                                       : Rgb(m_values[3 * i], m_values[3 * i + 1], m_values[3 * i + 2]);
        transfer.toWorking(colours);
        m_values.assign(&colours[0].x, &colours[0].x + 3 * texels);
    }
    std::vector<float> m_values;
};

OIIO::TextureOpt::Wrap toOiio(Wrap wrap) {
    switch (wrap) {
    case Wrap::Repeat:
        return OIIO::TextureOpt::WrapPeriodic;
    case Wrap::Black:
        return OIIO::TextureOpt::WrapBlack;
    case Wrap::Clamp:
        break;
    }
    return OIIO::TextureOpt::WrapClamp;
}

} // namespace

struct TextureCache::File {
    OIIO::TextureSystem::TextureHandle* handle;
    OIIO::ImageCache::ImageHandle* image;
    std::filesystem::path path;
    Location where;
    int channels; ///< 1 or 3
    bool isSmall; ///< to be kept in memory as a whole, from the first lookup on
    mutable std::once_flag read{};
    mutable std::optional<TextureLevels> levels{}; ///< of a small file that could be read
};

struct TextureCache::Impl {
    OIIO::ImageCache* images;
    OIIO::TextureSystem* textures;

    explicit Impl(int megabytes) : images(OIIO::ImageCache::create(false)) {
        images->attribute("max_memory_MB", float(megabytes));
        images->attribute("autotile", 64);
        images->attribute("automip", 1);
        images->attribute("accept_untiled", 1);
        images->attribute("accept_unmipped", 1);
        textures = OIIO::TextureSystem::create(false, images);
    }
    ~Impl() {
        for (OIIO::TextureSystem::Perthread* info : threads)
            textures->destroy_thread_info(info);
        OIIO::TextureSystem::destroy(textures, false);
        OIIO::ImageCache::destroy(images, false);
    }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    /// The calling thread's own part of the cache. OIIO would keep it, too, but under the cache's address: a
    /// thread that outlives one cache and meets another in its place would use what is gone.
    OIIO::TextureSystem::Perthread* ofThread() {
        bool exists = false;
        OIIO::TextureSystem::Perthread*& info = threads.local(exists);
        if (!exists)
            info = textures->create_thread_info();
        return info;
    }
    tbb::enumerable_thread_specific<OIIO::TextureSystem::Perthread*> threads;

    /// All levels of an image as the cache holds them; none when some cannot be read.
    std::optional<TextureLevels> readLevels(const File& file);

    /// Files of at most so many texels are kept in memory beside the cache, until they fill a budget.
    static constexpr int64_t kSmall = 1 << 20, kBudget = 8 << 20;
    std::mutex mutex;
    int64_t kept = 0; ///< texels of their finest levels

    /// The cache's name for the file: its own, or one that stands for its linearised values.
    OIIO::ustring nameOf(const std::filesystem::path& path, const Transfer& transfer);
    std::map<OIIO::ustring, Transfer> transfers; ///< by those names
};

OIIO::ustring TextureCache::Impl::nameOf(const std::filesystem::path& path, const Transfer& transfer) {
    if (!transfer.changes(false))
        return OIIO::ustring(path.string());
    const auto file = OIIO::ImageInput::open(path.string());
    if (!file || !transfer.changes(file->spec().format.is_floating_point())) {
        OIIO::geterror(); // of a file that cannot be opened: get_imagespec reports it
        return OIIO::ustring(path.string());
    }
    const std::string how[] = {"", "srgb", "gamma " + std::to_string(transfer.gamma),
                               "space " + transfer.space};
    const OIIO::ustring name(path.string() + "|" + how[transfer.kind]);
    const Transfer* kept = &transfers.try_emplace(name, transfer).first->second;
    OIIO::ImageSpec config;
    config.attribute("strobe:path", path.string());
    config.attribute("strobe:transfer", OIIO::TypeDesc::PTR, &kept);
    images->add_file(name, LinearizingInput::create, &config);
    return name;
}

std::optional<TextureLevels> TextureCache::Impl::readLevels(const File& file) {
    std::vector<Image> levels;
    OIIO::ImageSpec spec;
    for (int level = 0; images->get_imagespec(file.image, nullptr, spec, 0, level); ++level) {
        Image out{spec.width, spec.height, std::vector<Rgb>(size_t(spec.width) * size_t(spec.height))};
        std::vector<float> values(out.pixels.size() * size_t(file.channels));
        if (!images->get_pixels(file.image, nullptr, 0, level, 0, spec.width, 0, spec.height, 0, 1, 0,
                                file.channels, OIIO::TypeDesc::FLOAT, values.data()))
            return std::nullopt;
        for (size_t i = 0; i < out.pixels.size(); ++i)
            out.pixels[i] = file.channels == 1 ? Rgb(values[i])
                                               : Rgb(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
        levels.push_back(std::move(out));
        if (spec.width == 1 && spec.height == 1)
            break;
    }
    images->geterror(); // there may be no further level
    return levels.empty() ? std::nullopt : std::optional<TextureLevels>(std::move(levels));
}

TextureCache::TextureCache(int megabytes) : m_impl(std::make_unique<Impl>(megabytes)) {}
TextureCache::~TextureCache() = default;

std::shared_ptr<const TextureCache::File>
TextureCache::open(const std::filesystem::path& path, const Location& where, const Transfer& transfer) {
    const OIIO::ustring name = m_impl->nameOf(path, transfer);
    OIIO::TextureSystem& textures = *m_impl->textures;
    OIIO::TextureSystem::Perthread* thread = m_impl->ofThread();
    OIIO::TextureSystem::TextureHandle* handle = textures.get_texture_handle(name, thread);
    OIIO::ImageSpec spec;
    if (!textures.get_imagespec(handle, thread, 0, spec))
        throw Error(where, "cannot read the image " + path.string() + ": " + textures.geterror());
    const int64_t texels = int64_t(spec.width) * spec.height;
    const bool isPlain = spec.x == 0 && spec.y == 0 && spec.full_x == 0 && spec.full_y == 0 &&
                         spec.full_width == spec.width && spec.full_height == spec.height;
    const std::lock_guard lock(m_impl->mutex);
    const bool isSmall = isPlain && texels <= Impl::kSmall && m_impl->kept + texels <= Impl::kBudget;
    m_impl->kept += isSmall ? texels : 0;
    return std::shared_ptr<const File>(new File{handle, m_impl->images->get_image_handle(name), path, where,
                                                spec.nchannels >= 3 ? 3 : 1, isSmall});
}

Rgb TextureCache::lookup(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                         Wrap wrap) const {
    if (file.isSmall) {
        std::call_once(file.read, [&] { file.levels = m_impl->readLevels(file); });
        Rgb c;
        if (file.levels && file.levels->lookup(uv, duvdx, duvdy, wrap, c))
            return c;
    }
    return lookupFiltered(file, uv, duvdx, duvdy, wrap);
}

Rgb TextureCache::lookupFiltered(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                                 Wrap wrap) const {
    OIIO::TextureOpt options;
    options.swrap = options.twrap = toOiio(wrap);
    options.interpmode = OIIO::TextureOpt::InterpBilinear; // bicubic overshoots
    const bool isPoint = duvdx == V2f(0) && duvdy == V2f(0);
    options.mipmode = isPoint ? OIIO::TextureOpt::MipModeNoMIP : OIIO::TextureOpt::MipModeAniso;
    float result[3];
    OIIO::TextureSystem& system = *m_impl->textures;
    if (!system.texture(file.handle, m_impl->ofThread(), options, uv.x, uv.y, duvdx.x, duvdx.y, duvdy.x,
                        duvdy.y, file.channels, result))
        throw Error(file.where, "cannot read the image " + file.path.string() + ": " + system.geterror());
    return file.channels == 1 ? Rgb(result[0]) : Rgb(result[0], result[1], result[2]);
}

} // namespace strobe
