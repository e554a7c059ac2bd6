// Image textures: opened once per scene, cached, and filtered by footprint.
#pragma once

#include "core/image/image.h"
#include "core/math/soa.h"

#include <mutex>

namespace strobe {

/// Points of images with the axes of their footprints, side by side.
struct TexturePointSoA {
    V2SoA uv, duvdx, duvdy;
};

/// An encoded image (PNG or JPEG) in memory. `name` is its own among all that one cache opens, and is what
/// messages call it.
struct EncodedImage {
    std::string name;
    std::vector<unsigned char> bytes;
};

/// Which channels of an image make a texture.
enum class TextureChannels { Color, Alpha };

class MipMap;

/// The image library's texture system: tiled, cached, filtered by footprint. One per scene; lookups are
/// thread-safe.
class TextureCache : public std::enable_shared_from_this<TextureCache> {
  public:
    explicit TextureCache(int megabytes = 256);
    ~TextureCache();
    TextureCache(const TextureCache&) = delete;
    TextureCache& operator=(const TextureCache&) = delete;
    /// An opened file; throws a located Error when it cannot be read.
    struct File;
    std::shared_ptr<const File> open(const std::filesystem::path& path, const Location& where,
                                     const ColorEncoding& transfer = {});
    /// The same of an image in memory, whose alpha is not multiplied into its color; null when it has not
    /// the part that is wanted. The values of an Alpha part are read as they are stored.
    std::shared_ptr<const File> open(std::shared_ptr<const EncodedImage> image, const Location& where,
                                     const ColorEncoding& transfer, TextureChannels part);
    /// The filtered color at `uv` (v = 0 is the image's first row), over the ellipse duvdx, duvdy; zero
    /// derivatives give a bilinear lookup in the finest level. Gray images are spread to three channels.
    /// Throws the located Error of `open` when a part of the file that was not read before turns out to be
    /// damaged.
    Rgb lookup(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
               const TextureOptions& how) const;
    Rgb lookup(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap) const {
        return lookup(file, uv, duvdx, duvdy, TextureOptions{wrap, wrap});
    }
    /// The same at points `begin` to `end`, to the same bits.
    void lookupSoA(const File& file, const TexturePointSoA& at, int begin, int end, const TextureOptions& how,
                   RgbSoA& out) const;
    /// The same without images kept in memory beside the cache: what `lookup` is held against.
    Rgb lookupFiltered(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                       const TextureOptions& how) const;
    Rgb lookupFiltered(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap) const {
        return lookupFiltered(file, uv, duvdx, duvdy, TextureOptions{wrap, wrap});
    }

  private:
    struct Impl;
    Impl& impl();
    static const MipMap* levelsOf(const File& file, const TextureOptions& how);

    const int m_megabytes;
    std::once_flag m_made;
    std::unique_ptr<Impl> m_impl; ///< from the first `open` on
};

} // namespace strobe
