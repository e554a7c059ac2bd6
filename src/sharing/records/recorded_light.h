// The light of all samples that were recorded: the input of the reconstruction.
#pragma once

#include "core/film/film.h"
#include "core/util/memory.h"
#include "sharing/records/tile_light.h"

namespace strobe {

/// The sums of one half of a pixel's samples, weighted by the pixel filter: HalfLight as floats.
struct HalfPixelSums {
    uint32_t count = 0; ///< samples
    /// The light at first vertices that their albedo modulates.
    Rgb light[kParts] = {Rgb(0), Rgb(0)};
    /// Of the first half of these samples: a quarter of those of the pixel.
    uint32_t quarterCount = 0;
    Rgb quarterLight[kParts] = {Rgb(0), Rgb(0)};
    Rgb emitted = Rgb(0); ///< FirstVertex::emitted
    // Moments of the emission e and of the whole radiance v: means of the channels.
    float v = 0, ee = 0, ve = 0;

    /// Returns one of the sums divided by the number of samples; there are some.
    Rgb mean(const Rgb& sum) const { return sum * (1 / float(count)); }
};

/// The use of a cell by one half of a pixel.
struct PixelUse {
    uint32_t cell : 31; ///< index in RecordedLight::cells
    uint32_t half : 1;
    Rgb albedo; ///< the sum over the samples, weighted by the pixel filter
};

/// A rare sample of a pixel.
struct PixelRareSample : RareSample { ///< RareSample::cell is an index in RecordedLight::cells
    uint32_t pixel = 0;               ///< row by row in the pixel bounds
    uint32_t half = 0;
};

/// The sums of the records of a film. They do not depend on the order of the records, nor on how the samples
/// were divided into records.
class RecordedLight {
  public:
    /// Joins the records of a film. Throws Error of kind Usage if one is damaged.
    explicit RecordedLight(const Film& film);

    const HalfPixelSums& pixel(size_t index, int half) const {
        return pixels[kHalves * index + size_t(half)];
    }
    /// Returns the uses of cells of a pixel, by half and cell. `row`: that of the pixel, from 0 on.
    std::span<const PixelUse> uses(size_t row, size_t pixel) const {
        const uint32_t first = pixel == row * size_t(pixelBounds.width()) ? 0 : m_endOfUses[pixel - 1];
        return m_usesOfRow[row].uses.subspan(first, m_endOfUses[pixel] - first);
    }
    std::span<const PixelUse> uses(size_t pixel) const {
        return uses(pixel / size_t(pixelBounds.width()), pixel);
    }

    const PixelBounds pixelBounds;
    LightParts parts; ///< that were recorded; the sums of the others are 0
    /// Pixels are numbered row by row in the pixel bounds.
    HugeVector<HalfPixelSums> pixels;
    HugeVector<CellSums> cells;        ///< by ascending id
    std::vector<EmissionSum> emission; ///< by ascending pixel, with one entry per pixel
    std::vector<PixelRareSample> rare; ///< by ascending pixel, in an order that depends on the samples only

  private:
    void joinCells(std::vector<TileLightReader>& tiles);
    void joinRow(int y, const std::vector<const TileLightReader*>& tiles, std::vector<PixelUse>& uses);
    void setUses(size_t index, PixelLight& light, std::vector<PixelUse>& usesOfRow);
    void joinEmission(const std::vector<TileLightReader>& tiles);

    struct UsesOfRow {
        std::span<const PixelUse> uses;
        std::shared_ptr<const char> memory; ///< a share of that of `uses`
    };
    std::vector<UsesOfRow> m_usesOfRow;
    std::vector<std::vector<PixelRareSample>> m_rareOfRow; ///< until they are joined
    std::vector<uint32_t> m_endOfUses;                     ///< by pixel; in the uses of its row
};

/// Replaces records of the same pixels, as of passes and of slices, by one record each, so that their memory
/// does not grow with the number of passes. Throws Error of kind Usage if a record is damaged.
void mergeRecordsOfSamePixels(FilmRecords& records);

} // namespace strobe
