// The light of all samples that were recorded: the input of the reconstruction.
#pragma once

#include "core/film/film.h"
#include "core/util/memory.h"
#include "sharing/records/joined_cells.h"
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

/// The number of uses of a pixel.
struct UseCount {
    uint32_t pixel; ///< row by row in the pixel bounds of the frame
    uint32_t count;
};

/// The uses, rare samples and emission of the pixels of a tile or of a row. A buffer while they are recorded.
struct PixelLists {
    std::vector<UseCount> counts;
    std::vector<PixelUse> uses; ///< pixel by pixel, in the order of `counts`
    std::vector<PixelRareSample> rare;
    std::vector<EmissionSum> emission; ///< EmissionSum::pixel is an index in the frame
    void clear();
};

/// The cells of a tile, and a copy of its PixelLists. Uses and rare samples refer to cells by their indices
/// in `cells`.
struct TileSums {
    SharedItems<CellSums> cells;
    SharedItems<UseCount> counts;
    SharedItems<PixelUse> uses;
    std::vector<PixelRareSample> rare;
    std::vector<EmissionSum> emission;
};

/// The light of all samples of a frame: the sums of the records of a film, or of tiles. They do not depend on
/// the order of the records or tiles, nor on how the samples were divided into these.
class RecordedLight {
  public:
    /// Joins the records of a film. Throws Error of kind Usage if one is damaged.
    explicit RecordedLight(const Film& film);
    /// For `setPixel` and `join`.
    RecordedLight(const PixelBounds& bounds, LightParts recorded);

    /// Sets the sums of a pixel. Appends its uses and its rare samples to `lists`. Threads may set different
    /// pixels.
    void setPixel(size_t index, PixelLight& light, PixelLists& lists);
    /// Joins tiles, whose pixels are set. Pixels of other tiles have no samples afterwards.
    void join(std::vector<TileSums> tiles);

    const HalfPixelSums& pixel(size_t index, int half) const {
        return pixels[kHalves * index + size_t(half)];
    }
    /// Returns the uses of cells of a pixel, by half and cell.
    std::span<const PixelUse> uses(size_t pixel) const { return m_uses[pixel]; }
    /// Frees the memory of the cells.
    void freeCells();

    const PixelBounds pixelBounds;
    LightParts parts; ///< that were recorded; the sums of the others are 0
    /// Pixels are numbered row by row in the pixel bounds.
    HugeBuffer<HalfPixelSums> pixels;
    HugeBuffer<JoinedCell> cells;      ///< in the order of `precedes`
    std::vector<EmissionSum> emission; ///< by ascending pixel, with one entry per pixel
    std::vector<PixelRareSample> rare; ///< by ascending pixel, in an order that depends on the samples only

  private:
    void joinCellsOf(std::vector<TileLightReader>& tiles);
    void joinRow(int y, const std::vector<const TileLightReader*>& tiles, PixelLists& lists);
    void addUses(size_t index, PixelLight& light, PixelLists& lists) const;
    void linkUses(std::span<const TileSums> tiles);
    void joinRareAndEmission(std::span<const TileSums> tiles);
    void clearPixelsWithout(std::span<const TileSums> tiles);

    HugeBuffer<std::span<const PixelUse>> m_uses; ///< by pixel
    // Memory that the cells and the uses are in:
    std::vector<std::shared_ptr<const char>> m_cellMemory, m_useMemory;
};

/// Replaces records of the same pixels, as of passes and of slices, by one record each, so that their memory
/// does not grow with the number of passes. Throws Error of kind Usage if a record is damaged.
void mergeRecordsOfSamePixels(FilmRecords& records);

} // namespace strobe
