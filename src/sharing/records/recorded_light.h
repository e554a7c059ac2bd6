// The light of all samples that were recorded: the input of the reconstruction.
#pragma once

#include "core/film/film.h"
#include "core/util/memory.h"
#include "sharing/records/joined_cells.h"
#include "sharing/records/tile_light.h"

namespace strobe {

/// The sums of the filter weights of the samples of one half of a pixel: their number for filters without
/// negative lobes.
struct HalfWeights {
    int32_t all = 0;
    int32_t quarter = 0; ///< of the first half of the samples: a quarter of those of the pixel
};

/// One part of the light at first vertices that their albedo modulates: the sums over the samples of one half
/// of a pixel, weighted by the pixel filter. HalfLight as floats.
struct HalfPart {
    Rgb light{0};
    Rgb quarterLight{0}; ///< of HalfWeights::quarter
};

/// The emission of a pixel, some of whose samples have any: sums weighted by the pixel filter.
struct PixelEmission {
    struct Half {
        Rgb emitted{0}; ///< FirstVertex::emitted
        // Moments of the emission e and of the whole radiance v: means of the channels.
        float ee = 0, ve = 0;
    };
    uint32_t pixel = 0; ///< row by row in the pixel bounds
    Half halves[kHalves];
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
    std::vector<PixelEmission> emission;
    std::vector<EmissionSum> refined; ///< EmissionSum::pixel is an index in the frame
    void clear();
};

/// The cells of a tile, and a copy of its PixelLists. Uses and rare samples refer to cells by their indices
/// in `cells`.
struct TileSums {
    SharedItems<CellSums> cells;
    SharedItems<UseCount> counts;
    SharedItems<PixelUse> uses;
    std::vector<PixelRareSample> rare;
    std::vector<PixelEmission> emission;
    std::vector<EmissionSum> refined;
};

/// The light of all samples of a frame: the sums of the records of a film, or of tiles. They do not depend on
/// the order of the records or tiles, nor on how the samples were divided into these.
class RecordedLight {
  public:
    /// Joins the records of a film. Throws Error of kind Usage if one is damaged.
    explicit RecordedLight(const Film& film);
    /// For `setPixel` and `join`.
    RecordedLight(const PixelBounds& bounds, LightParts recorded);

    /// Sets the weights and the light of a pixel. Appends its uses, rare samples and emission to `lists`.
    /// Threads may set different pixels.
    void setPixel(size_t index, PixelLight& light, PixelLists& lists);
    /// Joins tiles, whose pixels are set. Pixels of other tiles have no samples afterwards.
    void join(std::vector<TileSums> tiles);

    size_t pixelCount() const { return m_uses.size(); }
    const HalfWeights& weights(size_t pixel, int half) const {
        return m_weights[kHalves * pixel + size_t(half)];
    }
    /// Returns the sum of the filter weights of the samples of a pixel.
    int32_t weight(size_t pixel) const { return weights(pixel, 0).all + weights(pixel, 1).all; }
    /// Returns the sum of the whole radiance of the samples, weighted by the pixel filter: mean of the
    /// channels.
    float radiance(size_t pixel, int half) const { return m_radiance[kHalves * pixel + size_t(half)]; }
    // Precondition: the part was recorded.
    const HalfPart& light(LightPart part, size_t pixel, int half) const {
        return m_light[int(part)][kHalves * pixel + size_t(half)];
    }
    HalfPart& light(LightPart part, size_t pixel, int half) {
        return m_light[int(part)][kHalves * pixel + size_t(half)];
    }
    /// Returns the items of `emission` of the pixels first … end - 1.
    std::span<const PixelEmission> emissionOf(size_t first, size_t end) const;
    /// Returns the uses of cells of a pixel, by half and cell.
    std::span<const PixelUse> uses(size_t pixel) const { return m_uses[pixel]; }
    // Free memory.
    void freeCells() { HugeBuffer<JoinedCell>().swap(cells); }
    void freeLight(LightPart part) { HugeBuffer<HalfPart>().swap(m_light[int(part)]); }

    const PixelBounds pixelBounds;
    const LightParts parts; ///< that were recorded
    // Pixels are numbered row by row in the pixel bounds.
    HugeBuffer<JoinedCell> cells;        ///< in the order of `precedes`
    std::vector<PixelEmission> emission; ///< by ascending pixel
    std::vector<EmissionSum> refined;    ///< additional samples: by ascending pixel, with one entry per pixel
    std::vector<PixelRareSample> rare;   ///< by ascending pixel, in an order that depends on the samples only

  private:
    RecordedLight(const PixelBounds& bounds, std::vector<TileLightReader> tiles);
    void joinCellsOf(std::vector<TileLightReader>& tiles);
    void joinRow(int y, const std::vector<const TileLightReader*>& tiles, PixelLists& lists);
    void addUses(size_t index, PixelLight& light, PixelLists& lists) const;
    void setHalf(size_t pixel, int half, const HalfBytes& from);
    void linkUses(std::span<const TileSums> tiles);
    void joinLists(std::span<const TileSums> tiles);
    void clearPixelsWithout(std::span<const TileSums> tiles);

    // By pixel and half:
    HugeBuffer<HalfWeights> m_weights;
    HugeBuffer<float> m_radiance;
    HugeBuffer<HalfPart> m_light[kParts];                 ///< empty: not recorded
    HugeBuffer<std::span<const PixelUse>> m_uses;         ///< by pixel
    std::vector<std::shared_ptr<const char>> m_useMemory; ///< that the uses are in
};

/// Replaces records of the same pixels, as of passes and of slices, by one record each, so that their memory
/// does not grow with the number of passes. Throws Error of kind Usage if a record is damaged.
void mergeRecordsOfSamePixels(FilmRecords& records);

} // namespace strobe
