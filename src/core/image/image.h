// Images and their files, which core/image/image_library.h reads. EXRs are written by core/image/exr_file.h.
#pragma once

#include "core/color/color_config.h"
#include "core/image/image_library.h"
#include "core/interfaces/texture.h"
#include "core/math/math.h"
#include "core/util/error.h"

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace strobe {

/// An RGB image in memory, row 0 at the top.
struct Image {
    int width = 0, height = 0;
    std::vector<Rgb> pixels;
    const Rgb& at(int x, int y) const { return pixels[size_t(y) * width + x]; }
    Rgb& at(int x, int y) { return pixels[size_t(y) * width + x]; }
};

/// More than this, and an image is no texture and no environment, but an attack. Numbers of 32 bits will do
/// for its values.
constexpr int64_t kMaxImagePixels = int64_t(1) << 28;

/// How stored values become linear ones of the working space, before they are filtered.
struct ColorEncoding {
    enum Kind { Linear, Srgb, Gamma, Space };
    Kind kind = Linear;
    float gamma = 1;       ///< of kind Gamma: linear = stored^gamma
    bool ofFloats = false; ///< apply it to files that store floats, too (else to 8- and 16-bit files only)
    std::string space{};   ///< of kind Space: the name of a color space
    ColorTransform toWorking{}; ///< of kind Space

    /// From a space of a config, whatever type the files have. Throws as ColorConfig::toWorking does.
    static ColorEncoding of(const ColorConfig& config, const std::string& space, const Location& where);
    /// As the config's rules say for a file of this name, else `otherwise`.
    static ColorEncoding ofFile(const ColorConfig& config, const std::filesystem::path& file,
                                const Location& where, const ColorEncoding& otherwise);
    /// Whether it changes anything in files of floats, or in others.
    bool changes(bool floats) const;
    /// A stored value made linear, of any kind but Space.
    float linear(float stored) const;
};

/// Readies the reading of an image for a text that may not read everything (see ResourcePolicy): throws an
/// Error at `where` unless the name is that of a kind of image whose files cannot refer to others, and sees
/// to it that what its name says decides how it is read. Without such a guard it does nothing.
void checkImage(const std::filesystem::path& path, const Location& where);
/// Reads the first three channels (an image of one or two is gray: its first is spread to three), as stored
/// but for what `transfer` says. Throws a located Error.
Image readImage(const std::filesystem::path& path, const Location& where, const ColorEncoding& transfer = {});

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

/// Where an image's data window lies in the full frame (display window).
struct PixelBounds {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0; ///< half-open
    int width() const { return x1 - x0; }
    int height() const { return y1 - y0; }
};

/// Writes an 8-bit PNG of linear RGB as `view` shows it, clamped; an empty one is sRGB. There is never a
/// half-written file under the final name. Throws Error of kind Output.
void writePng(const std::filesystem::path& path, Image image, const Metadata& metadata,
              const ColorTransform& view = {});

/// The text that an image file's metadata has under `name`; empty when there is none, or no such image.
std::string readMetadata(const std::filesystem::path& path, const std::string& name);

} // namespace strobe
