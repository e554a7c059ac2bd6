#include "core/image/texture_cache.h"

#include "core/image/large_textures.h"
#include "core/image/mip_map.h"
#include "core/util/memory.h"
#include "core/util/resource_policy.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <set>

namespace strobe {
namespace {

Error cannotRead(const std::string& displayName, const Location& where, const std::string& reason) {
    return {where, "cannot read the image " + displayName + ": " + reason};
}

} // namespace

struct TextureCache::File {
    std::unique_ptr<const TextureHandle> texture; ///< null: `large` is not
    std::string displayName;                      ///< in error messages
    Location where;
    int channels;                           ///< 1 or 3
    bool isSmall;                           ///< the MIP levels are kept in memory from the first lookup on
    LargeTextures* largeTextures = nullptr; ///< null: not a large image
    std::shared_ptr<LargeTexture> large{};
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
    Impl(uint64_t limit, int megabytes) : files(imageLibrary().makeTextureSystem(megabytes)), large(limit) {}
    std::unique_ptr<TextureSystem> files;
    LargeTextures large;

    /// Small files have at most kMaxTexels texels in the finest level, and all of them together
    /// kMaxTotalTexels.
    static constexpr int64_t kMaxTexels = 1 << 20;
    static constexpr int64_t kMaxTotalTexels = 8 << 20;
    std::mutex mutex;                  ///< for the members below
    int64_t totalTexels = 0;           ///< of the finest levels of small files
    std::set<std::string> addedImages; ///< names passed to TextureSystem::addImage
    std::vector<std::weak_ptr<const File>> opened;
    size_t smallImages = 0, tiledImages = 0;

    /// Returns the name of the decoded values of `source` in the texture system, and adds them to it.
    /// `name` identifies the image.
    std::string addDecoded(const ImageSource& source, const std::string& name);
    /// Returns whether there is room for a small image, and takes it.
    bool isSmall(const ImageReader& header);
    std::shared_ptr<const File> open(const ImageSource& source, const std::string& displayName,
                                     const Location& where);
    std::shared_ptr<const File> add(std::shared_ptr<const File> file);
};

std::string TextureCache::Impl::addDecoded(const ImageSource& source, const std::string& name) {
    const std::string key = source.key(name);
    const std::lock_guard lock(mutex);
    if (addedImages.insert(key).second)
        files->addImage(
            key, [source](DecodedImage& out, std::string& error) { return source.decode(out, error); });
    return key;
}

bool TextureCache::Impl::isSmall(const ImageReader& header) {
    const int64_t texels = int64_t(header.width) * header.height;
    const std::lock_guard lock(mutex);
    const bool fits = header.isUncropped && texels <= kMaxTexels && totalTexels + texels <= kMaxTotalTexels;
    totalTexels += fits ? texels : 0;
    return fits;
}

std::shared_ptr<const TextureCache::File> TextureCache::Impl::add(std::shared_ptr<const File> file) {
    const std::lock_guard lock(mutex);
    opened.push_back(file);
    if (!file->large)
        ++(file->isSmall ? smallImages : tiledImages);
    return file;
}

std::shared_ptr<const TextureCache::File>
TextureCache::Impl::open(const ImageSource& source, const std::string& displayName, const Location& where) {
    std::string error;
    const auto header = source.open(error); // null: OpenImageIO may expand the name to several files
    const bool isSmallImage = header && isSmall(*header);
    if (header && !isSmallImage && LargeTextures::accepts(*header, source.encoding))
        return add(std::shared_ptr<const File>(new File{nullptr, displayName, where, 3, false, &large,
                                                        large.add(source, displayName, where, *header)}));
    const bool isDecoded = source.memory || (header && source.encoding.hasEffect(header->isFloat));
    auto texture = files->open(isDecoded ? addDecoded(source, displayName) : source.path, error);
    if (!texture)
        throw cannotRead(displayName, where, error);
    const int channels = texture->channels;
    if (!texture->isTiled)
        resourcePolicyOf(where).requireMemory(
            uint64_t(texture->width) * uint64_t(texture->height) * uint64_t(channels) * sizeof(float) * 4 / 3,
            "the image " + displayName, "reduce its resolution, or convert it with maketx", where);
    return add(std::shared_ptr<const File>(
        new File{std::move(texture), displayName, where, channels >= 3 ? 3 : 1, isSmallImage}));
}

namespace {

/// Returns the default limit of the memory for texels.
uint64_t defaultLimit() { return physicalMemory() / 2; }

} // namespace

bool TextureStatistics::thrashes() const {
    return pageBytesReadAgain > bytesInFiles || (tileBytesRead > 2 * tileBytesKnown && tileBytesRead > limit);
}

TextureCache::TextureCache(int megabytes)
    : m_limit(megabytes > 0 ? uint64_t(megabytes) << 20 : defaultLimit()) {}
TextureCache::~TextureCache() = default;

TextureCache::Impl& TextureCache::impl() {
    std::call_once(m_implOnce, [&] {
        constexpr uint64_t kMaxMegabytes = 1 << 20;
        m_impl = std::make_unique<Impl>(m_limit, int(std::clamp<uint64_t>(m_limit >> 20, 1, kMaxMegabytes)));
    });
    return *m_impl;
}

std::shared_ptr<const TextureCache::File>
TextureCache::open(const std::filesystem::path& path, const Location& where, const ColorEncoding& encoding) {
    checkImage(path, where);
    return impl().open(ImageSource{path.string(), nullptr, TextureChannels::Color, encoding}, path.string(),
                       where);
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
    return impl().open(source, image->name, where);
}

const MipMap* TextureCache::mipMapOf(const File& file, const TextureOptions& options) {
    if (file.large)
        return &file.largeTextures->mipMap(*file.large);
    if (!file.isSmall || options.u != options.v || options.u == Wrap::Mirror || options.nearest)
        return nullptr;
    std::call_once(file.mipMapOnce, [&] { file.mipMap = file.readMipMap(); });
    return file.mipMap ? &*file.mipMap : nullptr;
}

Rgb TextureCache::lookup(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                         const TextureOptions& options) const {
    const MipMap* mipMap = mipMapOf(file, options);
    if (Rgb c; mipMap && mipMap->lookup(uv, duvdx, duvdy, options, c))
        return c;
    return lookupRare(file, mipMap, uv, duvdx, duvdy, options);
}

Rgb TextureCache::lookupRare(const File& file, const MipMap* mipMap, const V2f& uv, const V2f& duvdx,
                             const V2f& duvdy, const TextureOptions& options) const {
    return file.large ? mipMap->lookupAnywhere(uv, duvdx, duvdy, options)
                      : lookupFiltered(file, uv, duvdx, duvdy, options);
}

void TextureCache::lookupSoA(const File& file, const TexturePointSoA& points, int begin, int end,
                             const TextureOptions& options, RgbSoA& out) const {
    alignas(64) int32_t isDone[kSoAWidth];
    const MipMap* mipMap = mipMapOf(file, options);
    if (mipMap)
        mipMap->lookupSoA(points, begin, end, options, out, isDone);
    else
        std::fill(isDone + begin, isDone + end, 0);
    for (int i = begin; i < end; ++i)
        if (!isDone[i])
            out.set(i, lookupRare(file, mipMap, points.uv.at(i), points.duvdx.at(i), points.duvdy.at(i),
                                  options));
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
                file && (file->hasInvalidValues.load(std::memory_order_relaxed) ||
                         (file->large && file->large->hasInvalidValues())))
                names.insert(file->displayName);
    }
    return {names.begin(), names.end()};
}

TextureStatistics TextureCache::statistics() const {
    TextureStatistics s;
    s.limit = m_limit;
    if (!m_impl)
        return s;
    const LargeTextureCounts large = m_impl->large.counts();
    const TileCounts tiles = m_impl->files->counts();
    s.largeImages = large.images;
    s.largeImagesRead = large.imagesRead;
    s.secondsToRead = large.secondsToRead;
    s.bytesInMemory = large.bytesInMemory;
    s.bytesInFiles = large.pages.bytesInFiles;
    s.pageBytesRead = large.pages.bytesRead;
    s.pageBytesReadAgain = large.pages.bytesReadAgain;
    s.tileBytesRead = tiles.bytesRead;
    s.tileBytesKnown = tiles.bytesKnown;
    const std::lock_guard lock(m_impl->mutex);
    s.smallImages = m_impl->smallImages;
    s.tiledImages = m_impl->tiledImages;
    return s;
}

} // namespace strobe
