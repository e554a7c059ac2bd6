// The seam to the library of images (OpenImageIO). It comes as a file of its own, which is loaded when an
// image is first read or a PNG written: it brings 240 libraries, and linking them takes longer than many a
// render.
#pragma once

#include "core/math/math.h"

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace strobe {

/// How an image texture is read outside [0,1]².
enum class Wrap { Repeat, Black, Clamp, Mirror };

/// How a texture is looked up beyond the place.
struct TextureOptions {
    Wrap u = Wrap::Repeat, v = Wrap::Repeat;
    bool nearest = false; ///< texels show as squares
};

/// A metadata entry of an output file.
using MetadataValue = std::variant<int, float, std::string>;
using Metadata = std::vector<std::pair<std::string, MetadataValue>>;

/// An image file, or one in memory, as it is stored.
class ImageReader {
  public:
    virtual ~ImageReader() = default;
    int width = 0, height = 0, depth = 0, channels = 0;
    int alpha = -1; ///< the channel; -1: none
    bool isFloat = false;
    /// The channels `first` to `last` (exclusive) of all pixels, row after row from the top. False: `error`
    /// says why.
    virtual bool read(int first, int last, float* out, std::string& error) = 0;
    /// Metadata; empty when there is none of this name.
    virtual std::string text(const std::string& name) const = 0;
};

/// An image's values, row after row from the top.
struct DecodedImage {
    int width = 0, height = 0, channels = 0;
    std::vector<float> values;
};

/// An opened texture: tiles and coarser levels are made and kept as they are needed. Thread-safe; lives no
/// longer than its TextureSystem.
class TextureHandle {
  public:
    virtual ~TextureHandle() = default;
    int width = 0, height = 0, channels = 0;
    bool isTiled = false; ///< else it is read as a whole, to make the coarser levels
    bool isPlain = false; ///< its pixels are those of the full frame
    /// The first `n` channels of all levels, the finest first; false: some cannot be read.
    virtual bool readLevels(int n, std::vector<DecodedImage>& out) const = 0;
    /// The first `n` channels at uv (v = 0 is the first row), filtered over the ellipse duvdx, duvdy; zero
    /// derivatives give a bilinear lookup in the finest level. False: `error` says why.
    virtual bool lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, const TextureOptions& how, int n,
                        float* out, std::string& error) const = 0;
};

/// A cache of textures.
class TextureSystem {
  public:
    /// Makes an image; false: `error` says why.
    using Decode = std::function<bool(DecodedImage& out, std::string& error)>;
    virtual ~TextureSystem() = default;
    /// `name` is from now on not a file's, but that of what `decode` makes, now or later and on any thread.
    virtual void define(const std::string& name, Decode decode) = 0;
    /// Null: `error` says why.
    virtual std::unique_ptr<const TextureHandle> open(const std::string& name, std::string& error) = 0;
};

class ImageLibrary {
  public:
    virtual ~ImageLibrary() = default;
    /// From now on files are read as what their names say, and not offered to one reader after the other.
    virtual void trustNames() const = 0;
    /// Null: `error` says why.
    virtual std::unique_ptr<ImageReader> open(const std::string& path, std::string& error) const = 0;
    /// A PNG or JPEG in memory, which outlives what is returned; alpha is not multiplied into its color.
    virtual std::unique_ptr<ImageReader> open(std::span<const unsigned char> encoded,
                                              std::string& error) const = 0;
    /// A PNG of 8-bit RGB, row after row from the top; empty: `error` says why.
    virtual std::vector<unsigned char> encodePng(int width, int height, std::span<const uint8_t> rgb,
                                                 bool isSrgb, const Metadata& metadata,
                                                 std::string& error) const = 0;
    virtual std::unique_ptr<TextureSystem> makeTextures(int megabytes) const = 0;
};

/// Loads the library on the first call, from where it lies beside the executable. Throws an Error when it is
/// not there.
const ImageLibrary& imageLibrary();

/// What the library's file exports: a function of this name and type.
inline constexpr const char* kImageLibrarySymbol = "strobeImageLibrary";
using ImageLibraryFunction = const ImageLibrary*();

} // namespace strobe
