#include "core/image/texture_cache.h"

#include "core/image/mip_map.h"
#include "core/util/resource_policy.h"

#include <mutex>
#include <optional>
#include <set>

namespace strobe {
namespace {

/// How an image is to be read whose values are not those of a file.
struct Recipe {
    std::string path;
    std::shared_ptr<const EncodedImage> memory; ///< in place of the path
    TextureChannels part = TextureChannels::Color;
    ColorEncoding transfer;

    std::unique_ptr<ImageReader> open(std::string& error) const {
        return memory ? imageLibrary().open(memory->bytes, error) : imageLibrary().open(path, error);
    }
    bool decode(DecodedImage& out, std::string& error) const;
};

/// Gray becomes a color: the space's gray need not be ours.
void convert(const ColorEncoding& transfer, DecodedImage& image) {
    const std::vector<float>& v = image.values;
    std::vector<Rgb> colors(v.size() / size_t(image.channels));
    for (size_t i = 0; i < colors.size(); ++i)
        colors[i] = image.channels == 1 ? Rgb(v[i]) : Rgb(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    transfer.toWorking(colors);
    image.values.assign(&colors[0].x, &colors[0].x + 3 * colors.size());
    image.channels = 3;
}

/// Makes values linear, so that MIP levels and filters work on light, not on encoded numbers. The whole file
/// is decoded: these are 8- and 16-bit images.
bool Recipe::decode(DecodedImage& out, std::string& error) const {
    const auto file = open(error);
    if (!file)
        return false;
    if (file->width < 1 || file->height < 1 || int64_t(file->width) * file->height > kMaxImagePixels) {
        error = std::to_string(file->width) + " x " + std::to_string(file->height) +
                " pixels are too many or too few";
        return false;
    }
    const bool isAlpha = part == TextureChannels::Alpha;
    const int colors = file->alpha > 0 ? file->alpha : file->channels;
    const int first = isAlpha ? std::max(file->alpha, 0) : 0, n = isAlpha ? 1 : colors >= 3 ? 3 : 1;
    out = {file->width, file->height, n, {}};
    out.values.resize(size_t(file->width) * size_t(file->height) * size_t(n));
    if (!file->read(first, first + n, out.values.data(), error))
        return false;
    if (!isAlpha && transfer.kind == ColorEncoding::Space)
        convert(transfer, out);
    else if (!isAlpha && transfer.kind != ColorEncoding::Linear)
        for (float& v : out.values)
            v = transfer.linear(v);
    return true;
}

Error cannotRead(const std::string& shown, const Location& where, const std::string& reason) {
    return {where, "cannot read the image " + shown + ": " + reason};
}

} // namespace

struct TextureCache::File {
    std::unique_ptr<const TextureHandle> texture;
    std::string shown; ///< in messages
    Location where;
    int channels; ///< 1 or 3
    bool isSmall; ///< to be kept in memory as a whole, from the first lookup on
    mutable std::once_flag read{};
    mutable std::optional<MipMap> levels{}; ///< of a small file that could be read

    std::optional<MipMap> readLevels() const;
};

/// All levels of an image as the cache holds them; none when some cannot be read.
std::optional<MipMap> TextureCache::File::readLevels() const {
    std::vector<DecodedImage> stored;
    if (!texture->readLevels(channels, stored))
        return std::nullopt;
    std::vector<Image> levels;
    for (const DecodedImage& from : stored) {
        const std::vector<float>& v = from.values;
        Image& level = levels.emplace_back(
            Image{from.width, from.height, std::vector<Rgb>(v.size() / size_t(channels))});
        for (size_t i = 0; i < level.pixels.size(); ++i)
            level.pixels[i] = channels == 1 ? Rgb(v[i]) : Rgb(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    }
    return MipMap(levels);
}

struct TextureCache::Impl {
    explicit Impl(int megabytes) : files(imageLibrary().makeTextures(megabytes)) {}
    std::unique_ptr<TextureSystem> files;

    /// Files of at most so many texels are kept in memory beside the cache, until they fill a budget.
    static constexpr int64_t kSmall = 1 << 20, kBudget = 8 << 20;
    std::mutex mutex;
    int64_t kept = 0;              ///< texels of their finest levels
    std::set<std::string> defined; ///< names that are not files' own

    /// The cache's name for the file: its own, or one that stands for its linearized values.
    std::string nameOf(const std::filesystem::path& path, const ColorEncoding& transfer);
    std::string nameOf(Recipe recipe, const std::string& name);
    std::shared_ptr<const File> open(const std::string& name, const std::string& shown,
                                     const Location& where);
};

std::string TextureCache::Impl::nameOf(Recipe recipe, const std::string& name) {
    const ColorEncoding& t = recipe.transfer;
    const std::string how[] = {"linear", "srgb", "gamma " + std::to_string(t.gamma), "space " + t.space};
    const std::string key = name + "|" + (recipe.part == TextureChannels::Alpha ? "alpha" : how[t.kind]);
    const std::lock_guard lock(mutex);
    if (defined.insert(key).second)
        files->define(key, [recipe = std::move(recipe)](DecodedImage& out, std::string& error) {
            return recipe.decode(out, error);
        });
    return key;
}

std::string TextureCache::Impl::nameOf(const std::filesystem::path& path, const ColorEncoding& transfer) {
    std::string error; // of a file that cannot be opened: TextureSystem::open reports it
    const auto file = transfer.changes(false) ? imageLibrary().open(path.string(), error) : nullptr;
    if (!file || !transfer.changes(file->isFloat))
        return path.string();
    return nameOf(Recipe{path.string(), nullptr, TextureChannels::Color, transfer}, path.string());
}

std::shared_ptr<const TextureCache::File>
TextureCache::Impl::open(const std::string& name, const std::string& shown, const Location& where) {
    std::string error;
    auto texture = files->open(name, error);
    if (!texture)
        throw cannotRead(shown, where, error);
    const int64_t texels = int64_t(texture->width) * texture->height;
    const int channels = texture->channels;
    if (!texture->isTiled)
        resourcePolicyOf(where).requireMemory(uint64_t(texels) * uint64_t(channels) * sizeof(float) * 4 / 3,
                                              "the image " + shown,
                                              "make it smaller, or convert it by maketx", where);
    const std::lock_guard lock(mutex);
    const bool isSmall = texture->isPlain && texels <= kSmall && kept + texels <= kBudget;
    kept += isSmall ? texels : 0;
    return std::shared_ptr<const File>(
        new File{std::move(texture), shown, where, channels >= 3 ? 3 : 1, isSmall});
}

TextureCache::TextureCache(int megabytes) : m_megabytes(megabytes) {}
TextureCache::~TextureCache() = default;

TextureCache::Impl& TextureCache::impl() {
    std::call_once(m_made, [&] { m_impl = std::make_unique<Impl>(m_megabytes); });
    return *m_impl;
}

std::shared_ptr<const TextureCache::File>
TextureCache::open(const std::filesystem::path& path, const Location& where, const ColorEncoding& transfer) {
    checkImage(path, where);
    return impl().open(impl().nameOf(path, transfer), path.string(), where);
}

std::shared_ptr<const TextureCache::File> TextureCache::open(std::shared_ptr<const EncodedImage> image,
                                                             const Location& where,
                                                             const ColorEncoding& transfer,
                                                             TextureChannels part) {
    const Recipe recipe{"", image, part, transfer};
    if (part == TextureChannels::Alpha) {
        std::string error; // of an image that cannot be opened: Impl::open reports it
        const auto stored = recipe.open(error);
        if (stored && stored->alpha < 0)
            return nullptr;
    }
    return impl().open(impl().nameOf(recipe, image->name), image->name, where);
}

/// Its levels, if they serve this kind of lookup, else null.
const MipMap* TextureCache::levelsOf(const File& file, const TextureOptions& how) {
    if (!file.isSmall || how.u != how.v || how.u == Wrap::Mirror || how.nearest)
        return nullptr;
    std::call_once(file.read, [&] { file.levels = file.readLevels(); });
    return file.levels ? &*file.levels : nullptr;
}

Rgb TextureCache::lookup(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                         const TextureOptions& how) const {
    const MipMap* levels = levelsOf(file, how);
    if (Rgb c; levels && levels->lookup(uv, duvdx, duvdy, how.u, c))
        return c;
    return lookupFiltered(file, uv, duvdx, duvdy, how);
}

void TextureCache::lookupSoA(const File& file, const TexturePointSoA& at, int begin, int end,
                             const TextureOptions& how, RgbSoA& out) const {
    alignas(64) int32_t found[kSoAWidth];
    if (const MipMap* levels = levelsOf(file, how))
        levels->lookupSoA(at, begin, end, how.u, out, found);
    else
        std::fill(found + begin, found + end, 0);
    for (int i = begin; i < end; ++i)
        if (!found[i])
            out.set(i, lookupFiltered(file, at.uv.at(i), at.duvdx.at(i), at.duvdy.at(i), how));
}

Rgb TextureCache::lookupFiltered(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                                 const TextureOptions& how) const {
    float c[3];
    std::string error;
    if (!file.texture->lookup(uv, duvdx, duvdy, how, file.channels, c, error))
        throw cannotRead(file.shown, file.where, error);
    return file.channels == 1 ? Rgb(c[0]) : Rgb(c[0], c[1], c[2]);
}

} // namespace strobe
