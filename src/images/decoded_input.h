// A reader of images that a function computes.
#pragma once

#include "core/image/image_library.h"

#include <OpenImageIO/imageio.h>

#include <array>
#include <cstring>

namespace strobe {

/// A reader for OIIO's image cache that presents the image of a Decode function as a file of scanlines.
class DecodedInput final : public OIIO::ImageInput {
  public:
    using Decode = TextureSystem::Decode;
    static OIIO::ImageInput* create() { return new DecodedInput; }
    /// Stores a pointer to the function in `config`, for `open`. The function must outlive the cache.
    static void setDecode(OIIO::ImageSpec& config, const Decode& decode) {
        config.attribute("strobe:decode", OIIO::TypeDesc::PTR, std::array<const void*, 1>{&decode}.data());
    }
    const char* format_name() const override { return "strobe-decoded"; }
    bool open(const std::string&, OIIO::ImageSpec&) override { return false; } // requires a configuration

    bool open(const std::string&, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) override {
        const OIIO::ParamValue* value = config.find_attribute("strobe:decode");
        std::string error;
        if (!value)
            return false;
        if (!(**static_cast<const Decode* const*>(value->data()))(m_image, error)) {
            errorfmt("{}", error);
            return false;
        }
        m_spec = OIIO::ImageSpec(m_image.width, m_image.height, m_image.channels, OIIO::TypeDesc::FLOAT);
        spec = m_spec;
        return true;
    }
    bool close() override { return true; }
    bool read_native_scanline(int subimage, int miplevel, int y, int, void* data) override {
        if (subimage != 0 || miplevel != 0 || y < 0 || y >= m_spec.height)
            return false;
        const size_t row = size_t(m_image.width) * size_t(m_image.channels);
        std::memcpy(data, &m_image.values[size_t(y) * row], row * sizeof(float));
        return true;
    }

  private:
    DecodedImage m_image;
};

} // namespace strobe
