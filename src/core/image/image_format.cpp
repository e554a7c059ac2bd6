#include "core/image/image_format.h"

#include <algorithm>
#include <cctype>

namespace strobe {

namespace {

constexpr std::pair<const char*, ImageFormat> kFormats[] = {
    {".exr", ImageFormat::Exr},   {".png", ImageFormat::Png},  {".jpg", ImageFormat::Jpeg},
    {".jpeg", ImageFormat::Jpeg}, {".tif", ImageFormat::Tiff}, {".tiff", ImageFormat::Tiff},
    {".hdr", ImageFormat::Hdr}};

} // namespace

std::optional<ImageFormat> imageFormatOf(const std::filesystem::path& file) {
    std::string extension = file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    for (const auto& [known, format] : kFormats)
        if (extension == known)
            return format;
    return std::nullopt;
}

std::string imageExtensions() {
    std::string names;
    for (const auto& [extension, format] : kFormats)
        names += (names.empty() ? "" : ", ") + std::string(extension);
    return names;
}

} // namespace strobe
