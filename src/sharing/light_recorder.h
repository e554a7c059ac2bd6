// Recording of light while rendering: the input of the reconstruction.
#pragma once

#include "core/render/integrator.h"
#include "core/util/index_table.h"
#include "sharing/pixel_uses.h"

#include <algorithm>

namespace strobe {

/// The sums of one half of a pixel's samples, weighted by the pixel filter.
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

    void add(const Rgb& emission, const Rgb& radiance, float weight) {
        ++count;
        const float mean = weight * (radiance.x + radiance.y + radiance.z) / 3;
        v += mean;
        if (isBlack(emission))
            return;
        emitted += emission * weight;
        const float e = weight * (emission.x + emission.y + emission.z) / 3;
        ee += e * e;
        ve += e * mean;
    }
    void add(const HalfPixelSums& other) {
        count += other.count;
        for (int part = 0; part < kParts; ++part) {
            light[part] += other.light[part];
            quarterLight[part] += other.quarterLight[part];
        }
        quarterCount += other.quarterCount;
        emitted += other.emitted;
        v += other.v;
        ee += other.ee;
        ve += other.ve;
    }
    /// The samples so far are the quarter.
    void finishQuarter() {
        quarterCount = count;
        std::copy(light, light + kParts, quarterLight);
    }
    /// Returns one of the sums divided by the number of samples; there are some.
    Rgb mean(const Rgb& sum) const { return sum * (1 / float(count)); }
};

/// The emission that the additional samples of a pixel found: see EmissionRefinement.
struct RefinedEmission {
    uint32_t pixel; ///< row by row in the pixel bounds
    PixelAccumulator emission;
};

/// The light of the samples rendered so far, by pixel and by cell.
struct RecordedLight {
    explicit RecordedLight(const PixelBounds& bounds)
        : pixelBounds(bounds), pixels(kHalves * size_t(bounds.width()) * size_t(bounds.height())) {}
    /// Pixels are numbered row by row in the pixel bounds.
    HalfPixelSums& pixel(size_t index, int half) { return pixels[kHalves * index + size_t(half)]; }
    const HalfPixelSums& pixel(size_t index, int half) const {
        return pixels[kHalves * index + size_t(half)];
    }
    uint32_t indexOf(const PixelRef& pixel) const {
        return uint32_t((pixel.y - pixelBounds.y0) * pixelBounds.width() + pixel.x - pixelBounds.x0);
    }
    /// Merges the uses of all passes so far, so that the memory does not grow with the passes. No thread may
    /// add meanwhile.
    void mergeUses() { uses = {merged(uses, pixels.size() / kHalves)}; }
    /// Adds uses; any thread may call it.
    void addUses(std::span<const CellUse> more) {
        const std::lock_guard lock(mutex);
        uses.emplace_back(more.begin(), more.end());
    }
    /// Adds the emission of a pixel; any thread may call it.
    void addRefined(uint32_t pixel, const PixelAccumulator& emission) {
        const std::lock_guard lock(mutex);
        refined.push_back({pixel, emission});
    }
    /// Adds samples; any thread may call it.
    void addRare(std::span<const RareSample> more) {
        const std::lock_guard lock(mutex);
        rare.insert(rare.end(), more.begin(), more.end());
    }

    const PixelBounds pixelBounds;
    LightCells cells;
    /// By batch. Batches are in any order, but those of one pixel are in the order of their passes.
    std::vector<std::vector<CellUse>> uses;
    std::vector<HalfPixelSums> pixels;
    std::vector<RareSample> rare;         ///< in any order
    std::vector<RefinedEmission> refined; ///< in any order
    std::mutex mutex;
};

/// Records the batches of one thread.
class LightRecorder {
  public:
    /// `cellSize`: the edge of cells in pixels, within a factor of √2.
    /// `clamp`: see RenderSettings.
    LightRecorder(const Scene& scene, RecordedLight& out, float cellSize, float clamp,
                  const RareLimits& rareLimits);
    ~LightRecorder();
    /// Records the radiance and the first vertices of a batch whose request i is that of sample i.
    void record(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                std::span<const FirstVertex> vertices);

  private:
    struct HalfPixel;
    struct Chunk;
    bool isStatic(const Hit& hit) const;
    void findRestPoints(std::span<const FirstVertex> vertices, V3SoA& p, V3SoA& n) const;
    void findHalves(const VisibilityBatch& batch);
    void setCellSize(const HalfPixel& half, std::span<const FirstVertex> vertices);
    void recordHalf(HalfPixel& half, const VisibilityBatch& batch, std::span<const Rgb> radiance,
                    std::span<const FirstVertex> vertices);
    float clampScale(const Rgb& radiance) const;
    void recordVertex(const FirstVertex& vertex, uint32_t i, float weight, float scale, const HalfPixel& half,
                      HalfPixelSums& sums, bool isInQuarter);
    CellUse& findUse(const HalfPixel& half, uint32_t cell);
    uint32_t findCell(const CellId& id);
    void flush();

    const Scene& m_scene;
    RecordedLight& m_out;
    const float m_cellSize, m_clamp;
    const RareLimits m_rareLimits;
    // The current batch:
    std::vector<Chunk> m_chunks;
    std::vector<HalfPixel> m_halves;
    IndexTable m_cellIndices;
    std::vector<CellSums> m_cells;
    uint32_t m_lastCell = 0;        ///< found last
    std::vector<CellUse> m_uses;    ///< `cell` is an index into m_cells
    std::vector<RareSample> m_rare; ///< likewise
};

class EmissionRefinement;

/// A worker that requests a shade for each sample, and records the light that they find.
class RecordingWorker : public IntegratorWorker {
  public:
    RecordingWorker(const Scene& scene, RecordedLight& out, float cellSize, float clamp,
                    const RareLimits& rareLimits, const EmissionRefinement* refinement = nullptr)
        : m_scene(scene), m_out(out), m_refinement(refinement),
          m_recorder(scene, out, cellSize, clamp, rareLimits) {}
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override;
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb>) override {
        return shaded;
    }
    void observe(const VisibilityBatch& batch, std::span<const Rgb> radiance,
                 std::span<const FirstVertex> vertices) override;

  private:
    const Scene& m_scene;
    RecordedLight& m_out;
    const EmissionRefinement* const m_refinement; ///< null: none
    LightRecorder m_recorder;
};

} // namespace strobe
