// The film: the mean of each pixel's samples, and layers that tell how it came about.
#pragma once

#include "core/film/aov.h"
#include "core/film/pixel_accumulator.h"
#include "core/image/exr_file.h"

#include <vector>

namespace strobe {

/// How files are made of pixels.
struct OutputSettings {
    float exposure = 0;    ///< of PNGs, in stops
    ColorTransform view{}; ///< of PNGs; empty: sRGB
    ExrSettings exr{};
    int threads = 1; ///< that compress EXRs; 0: one per core
};

/// Pixel values over a window of the full frame. Different pixels may be written by different threads.
class Film {
  public:
    Film(int fullWidth, int fullHeight, const PixelBounds& pixelBounds, std::vector<Aov> layers = {});

    /// From now on, what is added to a pixel joins what was added before. Costs 64 bytes per pixel.
    void keepSums() { m_sums.resize(m_image.pixels.size()); }
    /// The pixel's samples: all of them, unless the film keeps sums.
    void add(int x, int y, const PixelAccumulator& sum) {
        const size_t i = index(x, y);
        if (!m_sums.empty())
            m_sums[i].add(sum);
        m_image.pixels[i] = (m_sums.empty() ? sum : m_sums[i]).mean();
    }
    /// Adds another film's samples, pixel by pixel; it covers a part of this one, and both keep sums.
    void add(const Film& part);
    /// No samples.
    void clear();
    /// None in these pixels; the film keeps sums.
    void clear(const PixelBounds& tile);
    /// Whether each of these pixels has `samples` samples; the film keeps sums.
    bool holds(const PixelBounds& tile, uint32_t samples) const;
    /// Takes pixels and layers over, and sums if both keep them, from a film of the same window and layers.
    void copy(const Film& from, const PixelBounds& tile);
    /// Row by row over the window; empty if they are not kept.
    const std::vector<PixelAccumulator>& sums() const { return m_sums; }
    /// `value` of layer `index` (into `layers()`).
    void setLayer(size_t index, int x, int y, float value) {
        m_planes[index][size_t(y - m_pixelBounds.y0) * size_t(m_image.width) + size_t(x - m_pixelBounds.x0)] =
            value;
    }
    bool has(Aov layer) const;
    /// All of a layer, which must be one of `layers()`: row by row over the window.
    void setPlane(Aov layer, std::vector<float> values);
    const Image& image() const { return m_image; }
    const std::vector<Aov>& layers() const { return m_layers; }
    /// Row by row over the window; the layer must be one of `layers()`.
    const std::vector<float>& plane(Aov layer) const;
    const PixelBounds& pixelBounds() const { return m_pixelBounds; }
    int fullWidth() const { return m_fullWidth; }
    int fullHeight() const { return m_fullHeight; }

    /// Writes by the file name's extension: .exr (the first part, "rgba", has the color; layers are channels
    /// "name.Y" in a part "name", with all bits) or .png (no layers). Returns how many values an EXR's half
    /// floats could not hold. `more`: parts beside the film's own. Throws Error of kind Output.
    size_t write(const std::filesystem::path& path, const Metadata& metadata,
                 const OutputSettings& settings = {}, const std::vector<ExrPart>& more = {}) const;
    /// Throws what `write` would throw because of the name and the settings.
    void checkWrite(const std::filesystem::path& path, const OutputSettings& settings,
                    const std::vector<ExrPart>& more = {}) const;

  private:
    std::vector<ExrPart> exrParts(const std::vector<ExrPart>& more) const;
    size_t index(int x, int y) const {
        return size_t(y - m_pixelBounds.y0) * size_t(m_image.width) + size_t(x - m_pixelBounds.x0);
    }

    int m_fullWidth, m_fullHeight;
    PixelBounds m_pixelBounds;
    Image m_image;
    std::vector<PixelAccumulator> m_sums; ///< none, or one per pixel
    std::vector<Aov> m_layers;
    std::vector<std::vector<float>> m_planes; ///< beside m_layers
};

} // namespace strobe
