// The interface to OpenImageIO. Its implementation, libstrobe_images.so, is loaded when an image is first
// read, or one other than an EXR is first written: OpenImageIO depends on 240 shared libraries, and loading
// them takes longer than many renders.
//
// Functions that report errors take a string `error`, which receives the message on failure.
#pragma once

#include "core/image/image_format.h"
#include "core/math/api.h"
#include "core/math/math.h"

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace STROBE_API strobe {

/// The value of an image texture outside [0,1]².
enum class Wrap { Repeat, Black, Clamp, Mirror };

/// The wrap modes and the interpolation of a texture lookup.
struct TextureOptions {
    Wrap u = Wrap::Repeat, v = Wrap::Repeat;
    bool nearest = false; ///< nearest texel instead of bilinear interpolation
};

/// The metadata of an image file: names and values.
using MetadataValue = std::variant<int, float, std::string, M44f>; ///< matrices: EXR only
using Metadata = std::vector<std::pair<std::string, MetadataValue>>;

/// The type of the values of an image file: integers of 8 and 16 bits, floats of 16 and 32 bits. Files with
/// other types are read as the next larger one.
enum class StoredType { Byte, Word, Half, Float };

/// An opened image, in a file or in memory. Values are returned as stored, integers scaled to [0,1].
class ImageReader {
  public:
    virtual ~ImageReader() = default;
    int width = 0, height = 0, depth = 0, channels = 0;
    int alphaChannel = -1; ///< index of the alpha channel; -1: none
    bool isFloat = false;  ///< the file stores floating-point values
    StoredType stored = StoredType::Float;
    bool isTiled = false;                ///< the file stores tiles; else rows
    bool isUncropped = false;            ///< the data window equals the display window, at the origin
    std::shared_ptr<const void> owned{}; ///< memory that the reader needs; or null
    /// Writes channels first … last-1 of all pixels to `out`, row by row from the top. Returns false on
    /// failure.
    virtual bool read(int first, int last, float* out, std::string& error) = 0;
    /// Returns the size of a MIP level of the file; (0,0): it has no such level.
    virtual V2i levelSize(int level) = 0;
    /// Writes channels first … last-1 of a MIP level to `out`, as values of `type`. Integers of the file's
    /// type are not scaled. Returns false on failure.
    virtual bool readLevel(int level, int first, int last, StoredType type, std::byte* out,
                           std::string& error) = 0;
    /// Returns the metadata string with this name; an empty string if there is none.
    virtual std::string metadata(const std::string& name) const = 0;
};

/// An image in memory, row by row from the top, with interleaved channels.
struct DecodedImage {
    int width = 0, height = 0, channels = 0;
    std::vector<float> values;
};

/// Pixels as a file stores them, row by row from the top, with interleaved channels: RGB, or RGB and alpha,
/// by which RGB is not multiplied. Integers are scaled to the range of their type.
struct StoredPixels {
    int width = 0, height = 0, channels = 3;
    std::variant<std::vector<uint8_t>, std::vector<uint16_t>, std::vector<float>> values;
};

/// An opened texture. Tiles and MIP levels are read or computed on demand and cached. Thread-safe. Must not
/// outlive its TextureSystem.
class TextureHandle {
  public:
    virtual ~TextureHandle() = default;
    int width = 0, height = 0, channels = 0;
    bool isTiled = false;     ///< else the whole file is read, to compute the coarser levels
    bool isUncropped = false; ///< the data window equals the display window, at the origin
    /// Writes the first `n` channels of all MIP levels to `out`, starting with the finest. Returns false if a
    /// level cannot be read.
    virtual bool readLevels(int n, std::vector<DecodedImage>& out, std::string& error) const = 0;
    /// Writes the first `n` channels at `uv` to `out`, filtered over the ellipse with axes duvdx and duvdy. v
    /// = 0 is the top of the first row. Zero derivatives select bilinear interpolation in the finest level.
    /// Returns false on failure.
    virtual bool lookup(const V2f& uv, const V2f& duvdx, const V2f& duvdy, const TextureOptions& options,
                        int n, float* out, std::string& error) const = 0;
};

/// Counts of the tiles that a texture cache has read.
struct TileCounts {
    uint64_t bytesRead = 0;  ///< from files
    uint64_t bytesKnown = 0; ///< of all levels of all images
};

/// A texture cache.
class TextureSystem {
  public:
    /// Computes an image. Returns false on failure.
    using Decode = std::function<bool(DecodedImage& out, std::string& error)>;
    virtual ~TextureSystem() = default;
    /// Adds an image with this name to the cache. `decode` computes it when it is first read, on any thread,
    /// and again if the cache has closed it. Has no effect if the name exists.
    virtual void addImage(const std::string& name, Decode decode) = 0;
    /// Opens a file, or an image added by `addImage`. Returns null on failure.
    virtual std::unique_ptr<const TextureHandle> open(const std::string& name, std::string& error) = 0;
    virtual TileCounts counts() const = 0;
};

/// The functions of OpenImageIO that strobe uses.
class ImageLibrary {
  public:
    virtual ~ImageLibrary() = default;
    /// From now on, selects the reader of a file by its extension alone; without this, all readers are tried
    /// if the first one fails. Affects the whole process.
    virtual void readByExtensionOnly() const = 0;
    /// Opens an image file. Returns null on failure.
    virtual std::unique_ptr<ImageReader> open(const std::string& path, std::string& error) const = 0;
    /// Opens a PNG or JPEG in memory. `encoded` must outlive the reader. Colors are not premultiplied by
    /// alpha. Returns null on failure.
    virtual std::unique_ptr<ImageReader> open(std::span<const unsigned char> encoded,
                                              std::string& error) const = 0;
    /// Returns an encoded file of any format but EXR; an empty vector on failure. `isSrgb`: the values are
    /// encoded in sRGB.
    virtual std::vector<unsigned char> encode(ImageFormat format, const StoredPixels& pixels, bool isSrgb,
                                              const Metadata& metadata, std::string& error) const = 0;
    /// Makes a texture system whose tile cache has at most `megabytes` MB.
    virtual std::unique_ptr<TextureSystem> makeTextureSystem(int megabytes) const = 0;
};

/// Returns the library. The first call loads it, from the directory of the executable or from its
/// installation directory; throws Error if it is not found. Thread-safe.
const ImageLibrary& imageLibrary();

/// The name and the type of the function that the shared library exports.
inline constexpr const char* kImageLibrarySymbol = "strobeImageLibrary";
using ImageLibraryFunction = const ImageLibrary*();

} // namespace strobe
