// A reader of image files that fails where OpenImageIO's readers only leave a message.
#pragma once

#include <OpenImageIO/imageio.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

namespace strobe {

/// Returns the error of a read that OpenImageIO says succeeded; empty if there is none. Truncated JPEG and
/// TIFF files are read so, and have gray or black pixels where data are missing. Clears the error of `input`.
/// Messages about bytes that JPEG readers skip without loss are ignored.
inline std::string hiddenError(const OIIO::ImageInput& input) {
    const std::string error = input.geterror();
    for (const char* harmless : {"extraneous bytes", "Invalid SOS parameters", "Adobe"})
        if (error.find(harmless) != std::string::npos)
            return "";
    return error;
}

/// Forwards to the reader of a file, for OpenImageIO's image cache. Reads with hidden errors fail.
class CheckedInput final : public OIIO::ImageInput {
  public:
    static OIIO::ImageInput* create() { return new CheckedInput; }
    /// Stores a pointer to a counter of the bytes of tiles in `config`, for `open`. The counter must outlive
    /// the cache.
    static void setCounter(OIIO::ImageSpec& config, std::atomic<uint64_t>& bytes) {
        config.attribute("strobe:bytes", OIIO::TypeDesc::PTR, std::array<const void*, 1>{&bytes}.data());
    }

    const char* format_name() const override { return m_input ? m_input->format_name() : "strobe-checked"; }
    int supports(OIIO::string_view feature) const override {
        return m_input ? m_input->supports(feature) : 0;
    }
    bool open(const std::string& name, OIIO::ImageSpec& spec) override { return open(name, spec, {}); }
    bool open(const std::string& name, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) override {
        if (const OIIO::ParamValue* bytes = config.find_attribute("strobe:bytes"))
            m_bytes = *static_cast<std::atomic<uint64_t>* const*>(bytes->data());
        m_input = OIIO::ImageInput::open(name, &config);
        if (!m_input) {
            errorfmt("{}", OIIO::geterror());
            return false;
        }
        spec = m_spec = m_input->spec();
        return true;
    }
    bool close() override { return !m_input || m_input->close(); }

    const OIIO::ImageSpec& spec() const override { return m_input ? m_input->spec() : m_spec; }
    OIIO::ImageSpec spec(int subimage, int level) override { return m_input->spec(subimage, level); }
    OIIO::ImageSpec spec_dimensions(int subimage, int level) override {
        return m_input->spec_dimensions(subimage, level);
    }
    int current_subimage() const override { return m_input->current_subimage(); }
    int current_miplevel() const override { return m_input->current_miplevel(); }
    bool seek_subimage(int subimage, int level) override {
        const bool isFound = m_input->seek_subimage(subimage, level);
        if (isFound)
            m_spec = m_input->spec();
        return isFound;
    }

    bool read_native_scanline(int subimage, int level, int y, int z, void* data) override {
        return checked(cleared().read_native_scanline(subimage, level, y, z, data));
    }
    bool read_scanlines(int subimage, int level, int y0, int y1, int z, int firstChannel, int lastChannel,
                        OIIO::TypeDesc format, void* data, OIIO::stride_t xStride,
                        OIIO::stride_t yStride) override {
        return checked(cleared().read_scanlines(subimage, level, y0, y1, z, firstChannel, lastChannel, format,
                                                data, xStride, yStride));
    }
    bool read_tiles(int subimage, int level, int x0, int x1, int y0, int y1, int z0, int z1, int firstChannel,
                    int lastChannel, OIIO::TypeDesc format, void* data, OIIO::stride_t xStride,
                    OIIO::stride_t yStride, OIIO::stride_t zStride) override {
        count(uint64_t(x1 - x0) * uint64_t(y1 - y0) * uint64_t(lastChannel - firstChannel) * format.size());
        return checked(cleared().read_tiles(subimage, level, x0, x1, y0, y1, z0, z1, firstChannel,
                                            lastChannel, format, data, xStride, yStride, zStride));
    }

    bool read_native_tile(int subimage, int level, int x, int y, int z, void* data) override {
        count(m_input->spec().tile_bytes(true));
        return checked(cleared().read_native_tile(subimage, level, x, y, z, data));
    }
    bool read_native_tiles(int subimage, int level, int x0, int x1, int y0, int y1, int z0, int z1,
                           void* data) override {
        const uint64_t pixels = uint64_t(x1 - x0) * uint64_t(y1 - y0);
        count(pixels * m_input->spec().pixel_bytes(true));
        return checked(cleared().read_native_tiles(subimage, level, x0, x1, y0, y1, z0, z1, data));
    }
    bool read_native_tiles(int subimage, int level, int x0, int x1, int y0, int y1, int z0, int z1,
                           int firstChannel, int lastChannel, void* data) override {
        const uint64_t pixels = uint64_t(x1 - x0) * uint64_t(y1 - y0);
        count(pixels * m_input->spec().pixel_bytes(firstChannel, lastChannel, true));
        return checked(cleared().read_native_tiles(subimage, level, x0, x1, y0, y1, z0, z1, firstChannel,
                                                   lastChannel, data));
    }

  private:
    /// Returns the input without errors that an earlier one at its address has left: OpenImageIO keeps them
    /// by address, for each thread.
    OIIO::ImageInput& cleared() {
        m_input->geterror();
        return *m_input;
    }
    void count(uint64_t bytes) {
        if (m_bytes)
            m_bytes->fetch_add(bytes, std::memory_order_relaxed);
    }
    /// Returns whether the read has succeeded and left no error; else passes the error on.
    bool checked(bool isRead) {
        const std::string error = isRead ? hiddenError(*m_input) : m_input->geterror();
        if (isRead && error.empty())
            return true;
        errorfmt("{}", error);
        return false;
    }

    std::unique_ptr<OIIO::ImageInput> m_input;
    std::atomic<uint64_t>* m_bytes = nullptr; ///< or null
};

} // namespace strobe
