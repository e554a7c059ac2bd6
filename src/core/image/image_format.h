// The formats of image files that strobe writes.
#pragma once

#include "core/math/api.h"

#include <filesystem>
#include <optional>
#include <string>

namespace STROBE_API strobe {

enum class ImageFormat {
    Exr,  ///< linear, with layers
    Hdr,  ///< linear, 8 bits with a common exponent (RGBE)
    Png,  ///< display values, 8 bits
    Jpeg, ///< display values, 8 bits, with loss
    Tiff  ///< display values, 16 bits
};

/// Returns the format of files with this extension, in any case; none if it is unknown.
std::optional<ImageFormat> imageFormatOf(const std::filesystem::path& file);
/// Returns the known extensions, separated by commas.
std::string imageExtensions();
/// Whether a view converts the pixels of this format to display values.
inline bool hasView(ImageFormat format) { return format != ImageFormat::Exr && format != ImageFormat::Hdr; }
/// Whether files of this format have an alpha channel.
inline bool hasAlpha(ImageFormat format) { return format != ImageFormat::Hdr && format != ImageFormat::Jpeg; }

} // namespace strobe
