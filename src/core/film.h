// The film: the mean of each pixel's samples.
#pragma once

#include "core/image.h"

#include <vector>

namespace strobe {

/// Pixel values over a window of the full frame. Different pixels may be written by different threads.
class Film {
  public:
    Film(int fullWidth, int fullHeight, const Window& window)
        : m_fullWidth(fullWidth), m_fullHeight(fullHeight),
          m_window(window), m_image{window.width(), window.height(),
                                    std::vector<Rgb>(size_t(window.width()) * window.height(), Rgb(0))} {}

    void set(int x, int y, const Rgb& value) { m_image.at(x - m_window.x0, y - m_window.y0) = value; }
    const Image& image() const { return m_image; }
    const Window& window() const { return m_window; }
    int fullWidth() const { return m_fullWidth; }
    int fullHeight() const { return m_fullHeight; }

    /// Writes by the file name's extension: .exr (float) or .png (sRGB). Throws Error of kind Output.
    void write(const std::filesystem::path& path, const Metadata& metadata) const;

  private:
    int m_fullWidth, m_fullHeight;
    Window m_window;
    Image m_image;
};

} // namespace strobe
