// Images and their files, which core/image/image_library.h reads. EXRs are written by core/image/exr_file.h.
#pragma once

#include "core/color/color_config.h"
#include "core/image/image_library.h"
#include "core/math/math.h"
#include "core/util/error.h"

#include <filesystem>
#include <memory>
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
    float gamma = 1; ///< of kind Gamma: linear = stored^gamma
    bool appliesToFloats =
        false;           ///< apply it to files that store floats, too (else to 8- and 16-bit files only)
    std::string space{}; ///< of kind Space: the name of a color space
    ColorTransform toWorking{}; ///< of kind Space

    /// From a space of a config, whatever type the files have. Throws as ColorConfig::toWorking does.
    static ColorEncoding fromSpace(const ColorConfig& config, const std::string& space,
                                   const Location& where);
    /// As the config's rules say for a file of this name, else `otherwise`.
    static ColorEncoding fromFileRules(const ColorConfig& config, const std::filesystem::path& file,
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

/// Writes an 8-bit PNG of linear RGB as `view` shows it, clamped; an empty one is sRGB. There is never a
/// half-written file under the final name. Throws Error of kind Output.
void writePng(const std::filesystem::path& path, Image image, const Metadata& metadata,
              const ColorTransform& view = {});

/// The text that an image file's metadata has under `name`; empty when there is none, or no such image.
std::string readMetadata(const std::filesystem::path& path, const std::string& name);

} // namespace strobe
