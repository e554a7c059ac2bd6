#include "core/guard.h"
#include "core/image.h"
#include "core/texture_levels.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/texture.h>
#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <cstring>
#include <functional>
#include <map>
#include <mutex>
#include <optional>

namespace strobe {
namespace {

/// More than this, and an image is no texture but an attack.
constexpr int64_t kMaxPixels = int64_t(1) << 28;

/// How a name of OIIO's cache is to be read; travels in the configuration that goes with the name.
struct Recipe {
    std::string path;
    const EncodedImage* memory = nullptr; ///< in place of the path
    ImagePart part = ImagePart::Colour;
    Transfer transfer;

    void write(OIIO::ImageSpec& config) const {
        config.attribute("strobe:recipe", OIIO::TypeDesc::PTR, std::array<const void*, 1>{this}.data());
    }
    static const Recipe* of(const OIIO::ImageSpec& config) {
        const OIIO::ParamValue* value = config.find_attribute("strobe:recipe");
        return value ? *static_cast<const Recipe* const*>(value->data()) : nullptr;
    }
};

/// Opens the image as it is stored; `memory` must outlive what is returned. Null: OIIO::geterror() says why.
std::unique_ptr<OIIO::ImageInput> openStored(const Recipe& recipe,
                                             std::optional<OIIO::Filesystem::IOMemReader>& memory) {
    if (!recipe.memory)
        return OIIO::ImageInput::open(recipe.path);
    const auto& bytes = recipe.memory->bytes;
    memory.emplace(bytes.data(), bytes.size());
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    void* proxy = &*memory; // OpenImageIO 2.4 forgets its argument where there is a configuration
    config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const bool isJpeg = bytes.size() > 2 && bytes[0] == 0xff && bytes[1] == 0xd8;
    return OIIO::ImageInput::open(isJpeg ? "memory.jpg" : "memory.png", &config, &*memory);
}

/// Presents an image to OIIO's cache with its values made linear, so that MIP levels and filters work on
/// light, not on encoded numbers. The whole file is decoded when it is opened: these are 8- and 16-bit
/// images.
class LinearizingInput : public OIIO::ImageInput {
  public:
    static OIIO::ImageInput* create() { return new LinearizingInput; }
    const char* format_name() const override { return "strobe-linearized"; }
    bool open(const std::string&, OIIO::ImageSpec&) override { return false; } // needs the configuration

    bool open(const std::string&, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) override {
        const Recipe* recipe = Recipe::of(config);
        if (!recipe)
            return false;
        std::optional<OIIO::Filesystem::IOMemReader> memory;
        const auto file = openStored(*recipe, memory);
        if (!file) {
            errorfmt("{}", OIIO::geterror());
            return false;
        }
        const OIIO::ImageSpec& stored = file->spec();
        if (stored.width < 1 || stored.height < 1 || int64_t(stored.width) * stored.height > kMaxPixels) {
            errorfmt("{} x {} pixels are too many or too few", stored.width, stored.height);
            return false;
        }
        const bool isAlpha = recipe->part == ImagePart::Alpha;
        const int alpha = stored.alpha_channel, colours = alpha > 0 ? alpha : stored.nchannels;
        const int first = isAlpha ? std::max(alpha, 0) : 0, n = isAlpha ? 1 : colours >= 3 ? 3 : 1;
        const size_t texels = size_t(stored.width) * size_t(stored.height);
        m_values.resize(texels * size_t(n));
        if (!file->read_image(0, 0, first, first + n, OIIO::TypeDesc::FLOAT, m_values.data())) {
            errorfmt("{}", file->geterror());
            return false;
        }
        const Transfer& transfer = recipe->transfer;
        const bool isSpace = !isAlpha && transfer.kind == Transfer::Space;
        if (isSpace)
            convert(transfer, texels, n);
        else if (!isAlpha && transfer.kind != Transfer::Linear)
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
    case Wrap::Mirror:
        return OIIO::TextureOpt::WrapMirror;
    case Wrap::Clamp:
        break;
    }
    return OIIO::TextureOpt::WrapClamp;
}

} // namespace

struct TextureCache::File {
    OIIO::TextureSystem::TextureHandle* handle;
    OIIO::ImageCache::ImageHandle* image;
    std::string shown; ///< in messages
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
    /// What names of the cache mean that are not files' own: kept, for OIIO reads files when it wants to.
    std::map<std::string, std::unique_ptr<const Recipe>> recipes;
    std::vector<std::shared_ptr<const EncodedImage>> memoryImages;

    /// The cache's name for the file: its own, or one that stands for its linearised values.
    OIIO::ustring nameOf(const std::filesystem::path& path, const Transfer& transfer);
    OIIO::ustring nameOf(Recipe recipe, const std::string& name);
    std::shared_ptr<const File> open(OIIO::ustring name, const std::string& shown, const Location& where);
};

OIIO::ustring TextureCache::Impl::nameOf(Recipe recipe, const std::string& name) {
    const Transfer& t = recipe.transfer;
    const std::string how[] = {"linear", "srgb", "gamma " + std::to_string(t.gamma), "space " + t.space};
    const std::string key = name + "|" + (recipe.part == ImagePart::Alpha ? "alpha" : how[t.kind]);
    auto& known = recipes[key];
    if (!known) {
        known = std::make_unique<const Recipe>(std::move(recipe));
        OIIO::ImageSpec config;
        known->write(config);
        images->add_file(OIIO::ustring(key), LinearizingInput::create, &config);
    }
    return OIIO::ustring(key);
}

OIIO::ustring TextureCache::Impl::nameOf(const std::filesystem::path& path, const Transfer& transfer) {
    if (!transfer.changes(false))
        return OIIO::ustring(path.string());
    const auto file = OIIO::ImageInput::open(path.string());
    if (!file || !transfer.changes(file->spec().format.is_floating_point())) {
        OIIO::geterror(); // of a file that cannot be opened: get_imagespec reports it
        return OIIO::ustring(path.string());
    }
    return nameOf(Recipe{path.string(), nullptr, ImagePart::Colour, transfer}, path.string());
}

std::shared_ptr<const TextureCache::File>
TextureCache::Impl::open(OIIO::ustring name, const std::string& shown, const Location& where) {
    OIIO::TextureSystem::Perthread* thread = ofThread();
    OIIO::TextureSystem::TextureHandle* handle = textures->get_texture_handle(name, thread);
    OIIO::ImageSpec spec;
    if (!textures->get_imagespec(handle, thread, 0, spec))
        throw Error(where, "cannot read the image " + shown + ": " + textures->geterror());
    const int64_t texels = int64_t(spec.width) * spec.height;
    if (spec.tile_width == 0) // it is read as a whole, to make the coarser levels
        guardOf(where).require(uint64_t(texels) * uint64_t(spec.nchannels) * sizeof(float) * 4 / 3,
                               "the image " + shown, "make it smaller, or convert it by maketx", where);
    const bool isPlain = spec.x == 0 && spec.y == 0 && spec.full_x == 0 && spec.full_y == 0 &&
                         spec.full_width == spec.width && spec.full_height == spec.height;
    const std::lock_guard lock(mutex);
    const bool isSmall = isPlain && texels <= kSmall && kept + texels <= kBudget;
    kept += isSmall ? texels : 0;
    return std::shared_ptr<const File>(
        new File{handle, images->get_image_handle(name), shown, where, spec.nchannels >= 3 ? 3 : 1, isSmall});
}

std::optional<TextureLevels> TextureCache::Impl::readLevels(const File& file) {
    // OIIO's own of the thread would keep tiles beyond the cache's end.
    const std::unique_ptr<OIIO::ImageCache::Perthread, std::function<void(OIIO::ImageCache::Perthread*)>>
        thread(images->create_thread_info(), [&](auto* info) { images->destroy_thread_info(info); });
    std::vector<Image> levels;
    OIIO::ImageSpec spec;
    for (int level = 0; images->get_imagespec(file.image, thread.get(), spec, 0, level); ++level) {
        Image out{spec.width, spec.height, std::vector<Rgb>(size_t(spec.width) * size_t(spec.height))};
        std::vector<float> values(out.pixels.size() * size_t(file.channels));
        if (!images->get_pixels(file.image, thread.get(), 0, level, 0, spec.width, 0, spec.height, 0, 1, 0,
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
    checkImage(path, where);
    return m_impl->open(m_impl->nameOf(path, transfer), path.string(), where);
}

std::shared_ptr<const TextureCache::File> TextureCache::open(std::shared_ptr<const EncodedImage> image,
                                                             const Location& where, const Transfer& transfer,
                                                             ImagePart part) {
    const Recipe recipe{"", image.get(), part, transfer};
    if (part == ImagePart::Alpha) {
        std::optional<OIIO::Filesystem::IOMemReader> memory;
        const auto stored = openStored(recipe, memory);
        if (stored && stored->spec().alpha_channel < 0)
            return nullptr;
        OIIO::geterror(); // of an image that cannot be opened: get_imagespec reports it
    }
    m_impl->memoryImages.push_back(image);
    return m_impl->open(m_impl->nameOf(recipe, image->name), image->name, where);
}

Rgb TextureCache::lookup(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                         const Lookup& how) const {
    if (file.isSmall && how.u == how.v && how.u != Wrap::Mirror && !how.nearest) {
        std::call_once(file.read, [&] { file.levels = m_impl->readLevels(file); });
        Rgb c;
        if (file.levels && file.levels->lookup(uv, duvdx, duvdy, how.u, c))
            return c;
    }
    return lookupFiltered(file, uv, duvdx, duvdy, how);
}

Rgb TextureCache::lookupFiltered(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                                 const Lookup& how) const {
    OIIO::TextureOpt options;
    options.swrap = toOiio(how.u), options.twrap = toOiio(how.v);
    options.interpmode = how.nearest ? OIIO::TextureOpt::InterpClosest
                                     : OIIO::TextureOpt::InterpBilinear; // bicubic overshoots
    const bool isPoint = duvdx == V2f(0) && duvdy == V2f(0);
    options.mipmode = isPoint ? OIIO::TextureOpt::MipModeNoMIP : OIIO::TextureOpt::MipModeAniso;
    float result[3];
    OIIO::TextureSystem& system = *m_impl->textures;
    if (!system.texture(file.handle, m_impl->ofThread(), options, uv.x, uv.y, duvdx.x, duvdx.y, duvdy.x,
                        duvdy.y, file.channels, result))
        throw Error(file.where, "cannot read the image " + file.shown + ": " + system.geterror());
    return file.channels == 1 ? Rgb(result[0]) : Rgb(result[0], result[1], result[2]);
}

} // namespace strobe
