// A cache of image textures, filtered by footprint.
#pragma once

#include "core/image/image.h"
#include "core/math/api.h"
#include "core/math/soa.h"

#include <mutex>

namespace STROBE_API strobe {

/// Lookup positions and the axes of their footprints, as a structure of arrays.
struct TexturePointSoA {
    V2SoA uv, duvdx, duvdy;
};

/// An encoded image (PNG or JPEG), in memory or in a file.
struct EncodedImage {
    std::string name; ///< unique among the images of a cache; used in error messages
    std::vector<unsigned char> bytes;
    std::filesystem::path file{}; ///< if not empty, has the bytes; it is read whenever they are needed
};

/// The channels of an image that a texture uses.
enum class TextureChannels { Color, Alpha };

/// Counts of the images of a cache, and of the bytes that were read for lookups.
struct TextureStatistics {
    size_t smallImages = 0;                      ///< kept as floats
    size_t largeImages = 0, largeImagesRead = 0; ///< kept in the type of their file
    size_t tiledImages = 0;                      ///< read tile by tile by OpenImageIO
    double secondsToRead = 0;                    ///< large images, of all threads together
    uint64_t limit = 0;                          ///< of the memory for texels, in bytes
    uint64_t bytesInMemory = 0;                  ///< of large images that are kept in memory as a whole
    uint64_t bytesInFiles = 0;                   ///< of large images that were moved to temporary files
    uint64_t pageBytesRead = 0, pageBytesReadAgain = 0; ///< from temporary files
    uint64_t tileBytesRead = 0, tileBytesKnown = 0;     ///< of tiled images

    /// Whether the limit is so small that the same texels are read again and again.
    bool thrashes() const;
};

class MipMap;

/// The textures of a scene. Small images are kept in memory as floats, larger ones in the type of their file
/// (see LargeTextures), tiled files are left to OpenImageIO's texture system (tiled, cached, filtered by
/// footprint). Values do not depend on the limit of the memory. Thread-safe.
class TextureCache : public std::enable_shared_from_this<TextureCache> {
  public:
    /// `megabytes`: the memory for the texels of large images, and also for tiles; 0: half of the memory of
    /// the machine.
    explicit TextureCache(int megabytes = 0);
    ~TextureCache();
    TextureCache(const TextureCache&) = delete;
    TextureCache& operator=(const TextureCache&) = delete;

    /// An opened image.
    struct File;
    /// Opens an image file whose values are decoded from `encoding`. Throws Error at `where` if it cannot be
    /// read.
    std::shared_ptr<const File> open(const std::filesystem::path& path, const Location& where,
                                     const ColorEncoding& encoding = {});
    /// Opens an encoded image. Colors are not premultiplied by alpha and are decoded from `encoding`; alpha
    /// is not decoded. Returns null if `channels` is Alpha and the image has no alpha channel. Throws Error
    /// at `where` if the image cannot be read.
    std::shared_ptr<const File> open(std::shared_ptr<const EncodedImage> image, const Location& where,
                                     const ColorEncoding& encoding, TextureChannels channels);

    /// Returns the color at `uv`, filtered over the ellipse with axes duvdx and duvdy. v = 0 is the top of
    /// the first row. Zero derivatives select bilinear interpolation in the finest level. Gray images have
    /// three equal channels. Throws Error at the location of `open` if the file is damaged where it is first
    /// read.
    Rgb lookup(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
               const TextureOptions& options) const;
    Rgb lookup(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap) const {
        return lookup(file, uv, duvdx, duvdy, TextureOptions{wrap, wrap});
    }
    /// Looks up points begin … end-1; same results as `lookup`, to the bit.
    void lookupSoA(const File& file, const TexturePointSoA& points, int begin, int end,
                   const TextureOptions& options, RgbSoA& out) const;
    /// Same as `lookup`, but always uses OpenImageIO, also for small images. The reference for tests of
    /// `lookup`. Precondition: the image is not large.
    Rgb lookupFiltered(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                       const TextureOptions& options) const;
    Rgb lookupFiltered(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap) const {
        return lookupFiltered(file, uv, duvdx, duvdy, TextureOptions{wrap, wrap});
    }

    /// Returns the names of images in which lookups have found values that are NaN or infinite.
    std::vector<std::string> imagesWithInvalidValues() const;
    TextureStatistics statistics() const;

  private:
    struct Impl;
    Impl& impl();
    /// Returns the MIP levels in memory if the file is large, or small and they support `options`; else null.
    static const MipMap* mipMapOf(const File& file, const TextureOptions& options);
    /// Looks up a point that the MIP levels leave to others.
    Rgb lookupRare(const File& file, const MipMap* mipMap, const V2f& uv, const V2f& duvdx, const V2f& duvdy,
                   const TextureOptions& options) const;

    const uint64_t m_limit; ///< of the memory for texels, in bytes
    std::once_flag m_implOnce;
    std::unique_ptr<Impl> m_impl; ///< created by the first `open`
};

} // namespace strobe
