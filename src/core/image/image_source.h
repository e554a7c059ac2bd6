// The images of textures, as files store them.
#pragma once

#include "core/image/texture_cache.h"

namespace strobe {

/// The values of a texture: an image in a file or in memory, its channels and their encoding.
struct ImageSource {
    std::string path;
    std::shared_ptr<const EncodedImage> memory; ///< if not null, replaces the path
    TextureChannels channels = TextureChannels::Color;
    ColorEncoding encoding;

    std::unique_ptr<ImageReader> open(std::string& error) const;
    /// Reads and decodes the image. Returns false on failure. Reads the whole file: encoded files have 8 or
    /// 16 bits per value. Values are decoded here, before OpenImageIO computes MIP levels and filters, so
    /// that it filters linear values.
    bool decode(DecodedImage& out, std::string& error) const;
    /// Returns the first channel that the texture uses, and sets `count` to their number: 1 or 3.
    int firstChannel(const ImageReader& file, int& count) const;
    /// Returns a text that identifies the values; `name` identifies the image.
    std::string key(const std::string& name) const;
};

} // namespace strobe
