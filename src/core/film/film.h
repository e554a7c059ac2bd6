// The film: the mean of each pixel's samples, and the AOVs of AovGroup::Sharing.
#pragma once

#include "core/film/aov.h"
#include "core/film/film_records.h"
#include "core/film/pixel_accumulator.h"
#include "core/image/exr_file.h"
#include "core/math/api.h"

#include <span>
#include <vector>

namespace STROBE_API strobe {

/// Settings for writing images.
struct OutputSettings {
    float exposure = 0;    ///< of formats with a view, in stops
    ColorTransform view{}; ///< of formats with a view; empty: sRGB
    ExrSettings exr{};
    int threads = 1; ///< that compress EXRs; 0: one per core
};

/// The image of a render, over pixel bounds within the full frame, with optional layers of one float per
/// pixel.
///
/// A pixel is the mean of its samples. By default all samples of a pixel are added at once, and only the mean
/// is stored. A film that accumulates (`enableAccumulation`) also stores the sums and can add samples to
/// previous ones, for passes, slices and checkpoints.
///
/// Sums are exact (PixelAccumulator): the film does not depend on the order or the grouping in which samples
/// were added, so films of disjoint samples merge to the same bits as one render of all samples. Layers are
/// not sums: `setLayerValue` overwrites.
///
/// An integrator that completes images at the end of a render (IntegratorState::finish) keeps what it needs
/// for that in the film's records, or, if the film does not accumulate, in its state.
///
/// Thread safety: threads may concurrently add to, set, clear and copy from different pixels, and use the
/// records. All other functions need exclusive access.
class Film {
  public:
    Film(int fullWidth, int fullHeight, const PixelBounds& pixelBounds, std::vector<Aov> layers = {});

    /// Makes the film accumulate. Takes 64 more bytes per pixel. Call it before samples are added.
    void enableAccumulation();
    bool accumulates() const { return !m_sums.empty(); }
    /// Adds samples of a pixel. They replace its previous samples unless the film accumulates.
    void add(int x, int y, const PixelAccumulator& sum) {
        const size_t i = index(x, y);
        if (!m_sums.empty())
            m_sums[i].add(sum);
        m_image.pixels[i] = (m_sums.empty() ? sum : m_sums[i]).mean();
    }
    /// Adds the samples and the records of another film, whose pixel bounds lie within this film's. Both
    /// films accumulate.
    void merge(const Film& other);
    /// Removes all samples and records, and sets the layers to zero.
    void clear();
    /// Clears the film and moves it to other pixel bounds of the same frame. Keeps its memory where it can.
    void moveTo(const PixelBounds& pixelBounds);
    /// Removes the samples of the pixels in `tile`, and the records that lie within it. The film accumulates.
    void clear(const PixelBounds& tile);
    /// Returns whether each pixel in `tile` has at least `samples` samples, valid or not. The film
    /// accumulates.
    bool hasSampleCount(const PixelBounds& tile, uint32_t samples) const;
    /// Copies the pixels in `tile`, their layers, the records that lie within it and, if both films
    /// accumulate, the sums of the pixels. The pixel bounds and the layers of both films are equal.
    void copyFrom(const Film& source, const PixelBounds& tile);
    /// Returns the sums of all pixels, row by row; empty unless the film accumulates.
    const std::vector<PixelAccumulator>& sums() const { return m_sums; }
    /// Sets the value of a pixel in the layer layers()[layerIndex].
    void setLayerValue(size_t layerIndex, int x, int y, float value) {
        m_planes[layerIndex][index(x, y)] = value;
    }
    FilmRecords& records() { return m_records; }
    const FilmRecords& records() const { return m_records; }
    /// The AOVs of the finished tiles (storeLayers), where RenderSettings::recordsLayers is true. They are
    /// copied and removed as the records are.
    FilmRecords& layerRecords() { return m_layerRecords; }
    const FilmRecords& layerRecords() const { return m_layerRecords; }
    bool has(Aov layer) const;
    /// Sets the values of a whole layer, row by row. Precondition: has(layer).
    void setPlane(Aov layer, std::vector<float> values);
    /// Adds a value to each pixel of the image, row by row. The sums do not change.
    void addToImage(std::span<const Rgb> values);
    /// Adds a value to a pixel of the image, by its number row by row.
    void addToImage(size_t pixel, const Rgb& value) { m_image.pixels[pixel] += value; }
    const Image& image() const { return m_image; }
    const std::vector<Aov>& layers() const { return m_layers; }
    /// Returns the values of a layer, row by row. Precondition: has(layer).
    const std::vector<float>& plane(Aov layer) const;
    const PixelBounds& pixelBounds() const { return m_pixelBounds; }
    int fullWidth() const { return m_fullWidth; }
    int fullHeight() const { return m_fullHeight; }

    /// Writes an image file in the format of imageFormatOf(path). The color of an EXR is the part "rgba";
    /// each layer is a part of its name with the 32-bit channel "name.Y"; `extraParts` follow. Other formats
    /// have the color only. `alpha`: a value per pixel, for the channel A; empty: none. Returns the number of
    /// values outside of the range of half floats (EXR). Throws Error of kind Output, and what `checkWrite`
    /// throws.
    size_t write(const std::filesystem::path& path, const Metadata& metadata,
                 const OutputSettings& settings = {}, const std::vector<ExrPart>& extraParts = {},
                 std::span<const float> alpha = {}) const;
    /// Throws Error if `write` cannot succeed with this file name and these settings.
    void checkWrite(const std::filesystem::path& path, const OutputSettings& settings,
                    const std::vector<ExrPart>& extraParts = {}) const;

  private:
    std::vector<ExrPart> exrParts(const std::vector<ExrPart>& extraParts, std::span<const float> alpha) const;
    /// The index of a pixel of the full frame in m_image, m_sums and m_planes.
    size_t index(int x, int y) const {
        return size_t(y - m_pixelBounds.y0) * size_t(m_image.width) + size_t(x - m_pixelBounds.x0);
    }

    int m_fullWidth, m_fullHeight;
    PixelBounds m_pixelBounds;
    Image m_image;
    std::vector<PixelAccumulator> m_sums; ///< per pixel; empty unless the film accumulates
    std::vector<Aov> m_layers;
    std::vector<std::vector<float>> m_planes; ///< per layer
    FilmRecords m_records;
    FilmRecords m_layerRecords;
};

} // namespace strobe
