// Recording of light while rendering.
#pragma once

#include "core/render/integrator.h"
#include "sharing/frame_light.h"
#include "sharing/records/light_units.h"
#include "sharing/records/tile_light.h"
#include "sharing/rest_points.h"

namespace strobe {

/// The sums of the samples of half a pixel on one cell, until they are added to the cell.
struct CellSlot {
    static constexpr int kOffsets = 6;             ///< position and normal: see CellSums
    static constexpr uint32_t kMaxCount = 1 << 11; ///< of samples, so that sums do not overflow

    CellId id;
    int64_t units[LightUnits::kCellCount] = {};
    int32_t offsets[kOffsets] = {};
    uint32_t count = 0;
};

/// Records the tiles of one thread.
class LightRecorder {
  public:
    /// `cellSize`: the edge of cells in pixels, within a factor of √2.
    /// `clamp`: see RenderSettings. `parts`: those to record. The frame outlives the recorder.
    LightRecorder(const Scene& scene, float cellSize, float clamp, LightParts parts,
                  const RareLimits& rareLimits, FrameLight& frame);
    ~LightRecorder();
    /// Begins a tile of the film. Forgets what was recorded since the last tile.
    void beginTile(const Film& film);
    /// Records the radiance and the first vertices of the samples in batch.filmSlice: request i is that of
    /// the i-th of these samples. Precondition: batch.slice has all samples of each pixel, so that the cells
    /// do not depend on the slice.
    void record(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                std::span<const FirstVertex> vertices);
    /// Adds samples of the emission of a pixel.
    void addEmission(const PixelRef& pixel, const PixelAccumulator& sum);
    /// Adds what was recorded to the frame, or to the records of the film.
    void finishTile(const PixelBounds& tile, Film& film);

  private:
    struct Chunk;
    void findRestPoints(std::span<const FirstVertex> vertices, V3SoA& p, V3SoA& n, V3SoA& ns) const;
    void gatherLight(std::span<const FirstVertex> vertices, std::span<const Rgb> radiance,
                     Chunk& chunk) const;
    void setPixelData(const VisibilityBatch& batch, std::span<const FirstVertex> vertices);
    void recordPixel(const VisibilityBatch& batch, uint32_t pixel);
    void recordSamples(const Chunk& chunk, int first, int end, uint32_t quarter);
    void recordEmission(const Chunk& chunk, int first, int end, HalfLight& half) const;
    void recordInCell(const Chunk& chunk, int i, uint32_t half);
    CellSlot& findSlot(const CellId& id);
    void emptySlots(uint32_t half);
    void recordSpecial(const Chunk& chunk, int i, uint32_t quarter);
    static void addUnits(const int64_t* units, RgbSum& sum);

    const Scene& m_scene;
    const SurfaceIds& m_surfaceIds;
    const PixelSpread m_spread;
    const float m_cellSize;
    const LightParts m_parts;
    const LightLimits m_limits;
    std::vector<Chunk> m_chunks;   ///< of the current batch
    PixelLight m_pixel;            ///< the current pixel
    std::vector<CellSlot> m_slots; ///< of the current half of the pixel
    FrameLight& m_frame;
    bool m_hasRecord = true; ///< the current tile is added to the film's records, not to the frame
    TileLight m_tile;        ///< the current tile, or its cells
    // Of the current tile, if it has no record:
    PixelLists m_lists;
    SampleSlice m_samples; ///< of the last batch
};

class EmissionRefinement;

/// A worker that requests a shade for each sample, and records the light that they find. Without parts of the
/// light, it records emission near the pixels that are refined, and needs no first vertices for this.
class RecordingWorker : public IntegratorWorker {
  public:
    /// See LightRecorder and EmissionRefinement.
    RecordingWorker(const Scene& scene, float cellSize, float clamp, LightParts parts, FrameLight& frame,
                    const RareLimits& rareLimits = {}, const EmissionRefinement* refinement = nullptr)
        : m_scene(scene), m_refinement(refinement), m_records(!parts.isEmpty()),
          m_recorder(scene, cellSize, clamp, parts, rareLimits, frame) {}
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override;
    std::span<const Rgb> resolve(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                 std::span<Rgb> values) override;
    std::span<const Rgb> resolveComponent(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                          std::span<Rgb> values, int /*component*/) override {
        return valuesOf(batch, shaded, values);
    }
    void observe(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                 std::span<const FirstVertex> vertices) override;
    void beginTile(const Film& film) override {
        if (m_records || m_refinement)
            m_recorder.beginTile(film);
        m_hasObserved = false;
    }
    void endTile(const PixelBounds& tile, Film& film) override {
        if (m_hasObserved)
            m_recorder.finishTile(tile, film);
    }

  private:
    static std::span<const Rgb> valuesOf(const VisibilityBatch& batch, std::span<const Rgb> shaded,
                                         std::span<Rgb> values);
    void observeEmission(const VisibilityBatch& batch, std::span<const Rgb> radiance);
    const Scene& m_scene;
    const EmissionRefinement* const m_refinement; ///< null: none
    const bool m_records;                         ///< any part of the light
    LightRecorder m_recorder;
    bool m_hasObserved = false; ///< in this tile
};

} // namespace strobe
