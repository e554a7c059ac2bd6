// Images in memory, reading of image files, and writing of PNG files. core/image/exr_file.h writes EXR files.
#pragma once

#include "core/color/color_config.h"
#include "core/image/image_library.h"
#include "core/math/api.h"
#include "core/math/math.h"
#include "core/util/error.h"

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace STROBE_API strobe {

/// An RGB image in memory. Row 0 is at the top.
struct Image {
    int width = 0, height = 0;
    std::vector<Rgb> pixels;
    const Rgb& at(int x, int y) const { return pixels[size_t(y) * width + x]; }
    Rgb& at(int x, int y) { return pixels[size_t(y) * width + x]; }
};

/// The maximum number of pixels of a texture or environment map. Guards against malicious files; the number
/// of values fits 32 bits.
constexpr int64_t kMaxImagePixels = int64_t(1) << 28;

/// The encoding of the values in an image file. Values are decoded to the working space before they are
/// filtered.
struct ColorEncoding {
    enum Kind { Linear, Srgb, Gamma, Space };
    Kind kind = Linear;
    float gamma = 1;              ///< for Gamma: linear = stored^gamma
    bool appliesToFloats = false; ///< also decode files that store floats; else only 8- and 16-bit files
    std::string space{};          ///< for Space: the name of the color space
    ColorTransform toWorking{};   ///< for Space

    /// Returns the encoding of a color space, for files of all types. Throws the errors of
    /// ColorConfig::toWorking.
    static ColorEncoding fromSpace(const ColorConfig& config, const std::string& space,
                                   const Location& where);
    /// Returns the encoding that the file rules of `config` assign to a file of this name; `fallback` if
    /// there is no such rule.
    static ColorEncoding fromFileRules(const ColorConfig& config, const std::filesystem::path& file,
                                       const Location& where, const ColorEncoding& fallback);
    /// Returns whether decoding changes the values of a file that stores floats (`isFloat`) or integers.
    bool hasEffect(bool isFloat) const;
    /// Returns the linear value of a stored value. Precondition: `kind` is not Space.
    float decode(float stored) const;
};

/// Checks an image file name if the source of `where` restricts files (see ResourcePolicy); does nothing
/// otherwise. Throws Error at `where` unless the extension denotes a format whose files cannot refer to other
/// files, and the name contains no pattern that OpenImageIO expands. Calls ImageLibrary::readByExtensionOnly.
void checkImage(const std::filesystem::path& path, const Location& where);
/// Reads an image file and decodes its values from `encoding`. The first three channels become RGB; images
/// with one or two channels are gray. Throws Error at `where`.
Image readImage(const std::filesystem::path& path, const Location& where, const ColorEncoding& encoding = {});

/// Writes a linear RGB image with writeFileAtomically, in the format of the extension, except EXR. `view`
/// converts to display values, which are clamped to [0,1]; without it, they are encoded in sRGB. `alpha`: a
/// value in [0,1] per pixel, by which the colors are multiplied; empty: opaque. Files store colors that are
/// not multiplied; formats without alpha store the image over black. Throws Error of kind Output.
void writeImage(const std::filesystem::path& path, Image image, const Metadata& metadata,
                const ColorTransform& view = {}, std::span<const float> alpha = {});

/// Returns the metadata string of an image file with this name; an empty string if there is none, or if the
/// file cannot be read.
std::string readMetadata(const std::filesystem::path& path, const std::string& name);

} // namespace strobe
