// A test fixture with a folder for images.
#pragma once

#include "core/image/exr_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <unistd.h>

namespace strobe {

namespace fs = std::filesystem;

/// Creates a folder for each test, and removes it at the end.
class ImageFiles : public testing::Test {
  protected:
    void SetUp() override { fs::create_directories(m_folder); }
    void TearDown() override { fs::remove_all(m_folder); }
    fs::path operator/(const std::string& name) const { return m_folder / name; }
    size_t fileCount() const {
        return size_t(std::distance(fs::directory_iterator(m_folder), fs::directory_iterator()));
    }
    fs::path m_folder = fs::temp_directory_path() / ("strobe-image-" + std::to_string(::getpid()));
};

/// Writes an EXR file with the channels R, G and B.
inline void writeRgb(const fs::path& path, const Image& image, const ExrSettings& settings = {}) {
    const float* data = &image.pixels[0].x;
    writeExr(path, {{0, 0, image.width, image.height}, {image.width, image.height}},
             {{"rgba", {{"R", data, 3}, {"G", data + 1, 3}, {"B", data + 2, 3}}}}, {}, settings);
}

} // namespace strobe
