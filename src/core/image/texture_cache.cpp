#include "core/image/texture_cache.h"

#include "core/image/mip_map.h"
#include "core/util/resource_policy.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <set>

namespace strobe {
namespace {

/// An image whose texture values differ from the values that OpenImageIO reads from a file: decoded, or in
/// memory.
struct ImageSource {
    std::string path;
    std::shared_ptr<const EncodedImage> memory; ///< if not null, replaces the path
    TextureChannels channels = TextureChannels::Color;
    ColorEncoding encoding;

    std::unique_ptr<ImageReader> open(std::string& error) const {
        return memory ? imageLibrary().open(memory->bytes, error) : imageLibrary().open(path, error);
    }
    /// Reads and decodes the image. Returns false on failure. Reads the whole file: encoded files have 8 or
    /// 16 bits per value. Values are decoded here, before OpenImageIO computes MIP levels and filters, so
    /// that it filters linear values.
    bool decode(DecodedImage& out, std::string& error) const;
};

/// Converts from a color space to the working space. Gray images become RGB, since gray in the color space
/// may have a tint in the working space.
void convert(const ColorEncoding& encoding, DecodedImage& image) {
    const std::vector<float>& v = image.values;
    std::vector<Rgb> colors(v.size() / size_t(image.channels));
    for (size_t i = 0; i < colors.size(); ++i)
        colors[i] = image.channels == 1 ? Rgb(v[i]) : Rgb(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    encoding.toWorking(colors);
    image.values.assign(&colors[0].x, &colors[0].x + 3 * colors.size());
    image.channels = 3;
}

bool ImageSource::decode(DecodedImage& out, std::string& error) const {
    const auto file = open(error);
    if (!file)
        return false;
    if (file->width < 1 || file->height < 1 || int64_t(file->width) * file->height > kMaxImagePixels) {
        error = std::to_string(file->width) + " x " + std::to_string(file->height) +
                " pixels are more than an image may have, or none";
        return false;
    }
    const bool isAlpha = channels == TextureChannels::Alpha;
    const int colors = file->alphaChannel > 0 ? file->alphaChannel : file->channels;
    const int first = isAlpha ? std::max(file->alphaChannel, 0) : 0;
    const int n = isAlpha ? 1 : colors >= 3 ? 3 : 1;
    out = {file->width, file->height, n, {}};
    out.values.resize(size_t(file->width) * size_t(file->height) * size_t(n));
    if (!file->read(first, first + n, out.values.data(), error))
        return false;
    if (!isAlpha && encoding.kind == ColorEncoding::Space)
        convert(encoding, out);
    else if (!isAlpha && encoding.kind != ColorEncoding::Linear)
        for (float& v : out.values)
            v = encoding.decode(v);
    return true;
}

Error cannotRead(const std::string& displayName, const Location& where, const std::string& reason) {
    return {where, "cannot read the image " + displayName + ": " + reason};
}

} // namespace

struct TextureCache::File {
    std::unique_ptr<const TextureHandle> texture;
    std::string displayName; ///< in error messages
    Location where;
    int channels; ///< 1 or 3
    bool isSmall; ///< the MIP levels are kept in memory from the first lookup on
    mutable std::once_flag mipMapOnce{};
    mutable std::optional<MipMap> mipMap{};            ///< of a small file; empty if it cannot be read
    mutable std::atomic<bool> hasInvalidValues{false}; ///< a lookup has found NaN or infinity

    /// Reads all MIP levels through OpenImageIO. Throws Error if the file is damaged.
    std::optional<MipMap> readMipMap() const;
};

std::optional<MipMap> TextureCache::File::readMipMap() const {
    std::vector<DecodedImage> stored;
    std::string error;
    if (!texture->readLevels(channels, stored, error)) {
        if (!error.empty())
            throw cannotRead(displayName, where, error);
        return std::nullopt;
    }
    std::vector<Image> levels;
    for (const DecodedImage& storedLevel : stored) {
        const std::vector<float>& v = storedLevel.values;
        Image& level = levels.emplace_back(
            Image{storedLevel.width, storedLevel.height, std::vector<Rgb>(v.size() / size_t(channels))});
        for (size_t i = 0; i < level.pixels.size(); ++i)
            level.pixels[i] = channels == 1 ? Rgb(v[i]) : Rgb(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    }
    const std::vector<Rgb>& finest = levels.front().pixels;
    if (!std::all_of(finest.begin(), finest.end(), isFinite))
        hasInvalidValues.store(true, std::memory_order_relaxed);
    return MipMap(levels);
}

struct TextureCache::Impl {
    explicit Impl(int megabytes) : files(imageLibrary().makeTextureSystem(megabytes)) {}
    std::unique_ptr<TextureSystem> files;

    /// Small files have at most kMaxTexels texels in the finest level, and all of them together
    /// kMaxTotalTexels.
    static constexpr int64_t kMaxTexels = 1 << 20;
    static constexpr int64_t kMaxTotalTexels = 8 << 20;
    std::mutex mutex;                  ///< for the members below
    int64_t totalTexels = 0;           ///< of the finest levels of small files
    std::set<std::string> addedImages; ///< names passed to TextureSystem::addImage
    std::vector<std::weak_ptr<const File>> opened;

    /// Returns the name of the file in the texture system: its path, or the name of its decoded values.
    std::string nameOf(const std::filesystem::path& path, const ColorEncoding& encoding);
    /// Returns the name of the decoded values of `source` in the texture system, and adds them to it.
    /// `name` identifies the image.
    std::string nameOf(ImageSource source, const std::string& name);
    std::shared_ptr<const File> open(const std::string& name, const std::string& displayName,
                                     const Location& where);
};

std::string TextureCache::Impl::nameOf(ImageSource source, const std::string& name) {
    const ColorEncoding& t = source.encoding;
    const std::string encodings[] = {"linear", "srgb", "gamma " + std::to_string(t.gamma),
                                     "space " + t.space};
    const std::string key =
        name + "|" + (source.channels == TextureChannels::Alpha ? "alpha" : encodings[t.kind]);
    const std::lock_guard lock(mutex);
    if (addedImages.insert(key).second)
        files->addImage(key, [source = std::move(source)](DecodedImage& out, std::string& error) {
            return source.decode(out, error);
        });
    return key;
}

std::string TextureCache::Impl::nameOf(const std::filesystem::path& path, const ColorEncoding& encoding) {
    std::string error; // ignored: TextureSystem::open reports files that cannot be opened
    const auto file = encoding.hasEffect(false) ? imageLibrary().open(path.string(), error) : nullptr;
    if (!file || !encoding.hasEffect(file->isFloat))
        return path.string();
    return nameOf(ImageSource{path.string(), nullptr, TextureChannels::Color, encoding}, path.string());
}

std::shared_ptr<const TextureCache::File>
TextureCache::Impl::open(const std::string& name, const std::string& displayName, const Location& where) {
    std::string error;
    auto texture = files->open(name, error);
    if (!texture)
        throw cannotRead(displayName, where, error);
    const int64_t texels = int64_t(texture->width) * texture->height;
    const int channels = texture->channels;
    if (!texture->isTiled)
        resourcePolicyOf(where).requireMemory(uint64_t(texels) * uint64_t(channels) * sizeof(float) * 4 / 3,
                                              "the image " + displayName,
                                              "reduce its resolution, or convert it with maketx", where);
    const std::lock_guard lock(mutex);
    const bool isSmall =
        texture->isUncropped && texels <= kMaxTexels && totalTexels + texels <= kMaxTotalTexels;
    totalTexels += isSmall ? texels : 0;
    const std::shared_ptr<const File> file(
        new File{std::move(texture), displayName, where, channels >= 3 ? 3 : 1, isSmall});
    opened.push_back(file);
    return file;
}

TextureCache::TextureCache(int megabytes) : m_megabytes(megabytes) {}
TextureCache::~TextureCache() = default;

TextureCache::Impl& TextureCache::impl() {
    std::call_once(m_implOnce, [&] { m_impl = std::make_unique<Impl>(m_megabytes); });
    return *m_impl;
}

std::shared_ptr<const TextureCache::File>
TextureCache::open(const std::filesystem::path& path, const Location& where, const ColorEncoding& encoding) {
    checkImage(path, where);
    return impl().open(impl().nameOf(path, encoding), path.string(), where);
}

std::shared_ptr<const TextureCache::File> TextureCache::open(std::shared_ptr<const EncodedImage> image,
                                                             const Location& where,
                                                             const ColorEncoding& encoding,
                                                             TextureChannels channels) {
    const ImageSource source{"", image, channels, encoding};
    if (channels == TextureChannels::Alpha) {
        std::string error; // ignored: Impl::open reports images that cannot be opened
        const auto stored = source.open(error);
        if (stored && stored->alphaChannel < 0)
            return nullptr;
    }
    return impl().open(impl().nameOf(source, image->name), image->name, where);
}

const MipMap* TextureCache::mipMapOf(const File& file, const TextureOptions& options) {
    if (!file.isSmall || options.u != options.v || options.u == Wrap::Mirror || options.nearest)
        return nullptr;
    std::call_once(file.mipMapOnce, [&] { file.mipMap = file.readMipMap(); });
    return file.mipMap ? &*file.mipMap : nullptr;
}

Rgb TextureCache::lookup(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                         const TextureOptions& options) const {
    const MipMap* mipMap = mipMapOf(file, options);
    if (Rgb c; mipMap && mipMap->lookup(uv, duvdx, duvdy, options.u, c))
        return c;
    return lookupFiltered(file, uv, duvdx, duvdy, options);
}

void TextureCache::lookupSoA(const File& file, const TexturePointSoA& points, int begin, int end,
                             const TextureOptions& options, RgbSoA& out) const {
    alignas(64) int32_t isDone[kSoAWidth];
    if (const MipMap* mipMap = mipMapOf(file, options))
        mipMap->lookupSoA(points, begin, end, options.u, out, isDone);
    else
        std::fill(isDone + begin, isDone + end, 0);
    for (int i = begin; i < end; ++i)
        if (!isDone[i])
            out.set(i,
                    lookupFiltered(file, points.uv.at(i), points.duvdx.at(i), points.duvdy.at(i), options));
}

Rgb TextureCache::lookupFiltered(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                                 const TextureOptions& options) const {
    float c[3];
    std::string error;
    if (!file.texture->lookup(uv, duvdx, duvdy, options, file.channels, c, error))
        throw cannotRead(file.displayName, file.where, error);
    const Rgb color = file.channels == 1 ? Rgb(c[0]) : Rgb(c[0], c[1], c[2]);
    if (!isFinite(color))
        file.hasInvalidValues.store(true, std::memory_order_relaxed);
    return color;
}

std::vector<std::string> TextureCache::imagesWithInvalidValues() const {
    std::set<std::string> names;
    if (m_impl) {
        const std::lock_guard lock(m_impl->mutex);
        for (const std::weak_ptr<const File>& opened : m_impl->opened)
            if (const auto file = opened.lock();
                file && file->hasInvalidValues.load(std::memory_order_relaxed))
                names.insert(file->displayName);
    }
    return {names.begin(), names.end()};
}

} // namespace strobe
