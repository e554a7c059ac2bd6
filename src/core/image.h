// Image files: the one file that knows OpenImageIO and OpenEXR.
#pragma once

#include "core/error.h"
#include "core/math.h"
#include "core/texture.h"

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace strobe {

/// An RGB image in memory, row 0 at the top.
struct Image {
    int width = 0, height = 0;
    std::vector<Rgb> pixels;
    const Rgb& at(int x, int y) const { return pixels[size_t(y) * width + x]; }
    Rgb& at(int x, int y) { return pixels[size_t(y) * width + x]; }
};

/// Reads the first three channels (an image of one or two is grey: its first is spread to three) as they are
/// stored: no colour conversion for float files, sRGB decoded to linear for integer files (8 and 16 bits)
/// when `decodeSrgb`. Throws a located Error.
Image readImage(const std::filesystem::path& path, const Location& where, bool decodeSrgb = false);

/// How an image texture is read outside [0,1]².
enum class Wrap { Repeat, Black, Clamp };

/// How stored values become linear ones, before they are filtered.
struct Transfer {
    enum Kind { Linear, Srgb, Gamma };
    Kind kind = Linear;
    float gamma = 1;       ///< of kind Gamma: linear = stored^gamma
    bool ofFloats = false; ///< apply it to files that store floats, too (else to 8- and 16-bit files only)
};

/// OIIO's texture system: tiled, cached, filtered by footprint. One per scene; lookups are thread-safe.
class TextureCache {
  public:
    explicit TextureCache(int megabytes = 256);
    ~TextureCache();
    TextureCache(const TextureCache&) = delete;
    TextureCache& operator=(const TextureCache&) = delete;
    /// An opened file; throws a located Error when it cannot be read.
    struct File;
    std::shared_ptr<const File> open(const std::filesystem::path& path, const Location& where,
                                     const Transfer& transfer = {});
    /// The filtered colour at `uv` (v = 0 is the image's first row), over the ellipse duvdx, duvdy; zero
    /// derivatives give a bilinear lookup in the finest level. Grey images are spread to three channels.
    /// Throws the located Error of `open` when a part of the file that was not read before turns out to be
    /// damaged.
    Rgb lookup(const File& file, const V2f& uv, const V2f& duvdx, const V2f& duvdy, Wrap wrap) const;

  private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

/// A metadata entry of an output file.
using MetadataValue = std::variant<int, float, std::string>;
using Metadata = std::vector<std::pair<std::string, MetadataValue>>;

/// One named channel of an output image: full name ("R", "normal.X") and width*height floats.
struct Channel {
    std::string name;
    const float* data;
    size_t stride = 1; ///< in floats, between pixels
};

/// Where an image's data window lies in the full frame (display window).
struct Window {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0; ///< half-open
    int width() const { return x1 - x0; }
    int height() const { return y1 - y0; }
};

/// Writes a float (or half) scanline EXR, ZIP compressed, to a temporary file beside `path` and renames it:
/// there is never a half-written file under the final name. Throws Error of kind Output, also for channel
/// names that repeat or are empty.
void writeExr(const std::filesystem::path& path, const Window& data, int fullWidth, int fullHeight,
              const std::vector<Channel>& channels, const Metadata& metadata, bool half = false);

/// Writes 8-bit sRGB PNG from linear RGB (clamped), likewise atomically.
void writePng(const std::filesystem::path& path, const Image& image, const Metadata& metadata);

/// The text that an image file's metadata has under `name`; empty when there is none, or no such image.
std::string readMetadata(const std::filesystem::path& path, const std::string& name);

/// The sRGB transfer function, linear [0,1] to encoded [0,1], and back.
float encodeSrgb(float linear);
float decodeSrgb(float encoded);

} // namespace strobe
