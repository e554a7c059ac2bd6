// The noise of the whole image, by blocks of pixels.
#pragma once

#include "core/render/integrator.h"
#include "core/util/parallel.h"
#include "sharing/emission/emission_refinement.h"
#include "sharing/pilots/brightness.h"

#include <algorithm>
#include <memory>
#include <mutex>

namespace strobe {

/// The samples of one half of the pilot in a block.
struct BlockNoise {
    float pairs = 0;
    float cameraHits = 0;   ///< samples whose camera ray hits something
    float vertices = 0;     ///< samples with a first vertex
    bool hitsLamps = false; ///< camera rays hit surfaces with emission brighter than 1
    // Sums over the samples:
    float radiance = 0; ///< clipped to 1; mean of the channels
    /// Sums over the pairs of the variance of a sample, of some light.
    struct Light {
        float variance = 0; ///< clipped to the number of samples of a pixel
        float raw = 0;      ///< not clipped
        float clipped = 0;  ///< clipped to 1
        float other = 0;    ///< of all other light: emission clipped to 1, indirect light like `variance`
    };
    Light all;
    Light vertex; ///< all but the emission that camera rays hit
    Light direct; ///< all but this emission and indirect light
};

/// A pilot with pairs of samples in 8 to 16 pixels of each block of 8x8 pixels: 6 % of the samples of a
/// render with 4 samples per pixel, at most 2 % from 13 samples on. The difference of a pair shows the
/// variance of a sample. The result depends on the scene, on context.pilotBounds and on the number of
/// samples, but not on the seed or on slices of the samples.
class PairPilot {
  public:
    static constexpr int kBlockSize = 8, kPair = 2;

    /// `samplesPerPixel`: of the render, at least 1.
    PairPilot(const Scene& scene, const RenderContext& context, double samplesPerPixel);
    ~PairPilot();
    PairPilot(const PairPilot&) = delete;
    PairPilot& operator=(const PairPilot&) = delete;

    /// Renders at most a fourth of the pilot: up to half of the pixels, at most one per sample of a pixel of
    /// the render, in the fields of one color of a chessboard of 2x2 blocks.
    void renderFirst();
    /// Renders what is left.
    void renderRest();
    /// The blocks; their factors are 1.
    const SampleFactors& blocks() const { return m_blocks; }
    /// The noise of a block; half 0 or 1: each has every other pair.
    const BlockNoise& noise(int half, size_t block) const { return m_halves[half][block]; }
    /// Returns the number of pairs in a block; 0: it is not rendered yet.
    float pairs(size_t block) const { return m_halves[0][block].pairs + m_halves[1][block].pairs; }
    /// Returns whether no block has pairs: all samples are invalid, or the image is so small that it contains
    /// none of the pixels.
    bool isEmpty() const;
    /// Calls `visit(i, weight)` for a block and its neighbors, for smoothing by a tent.
    template <class Visit>
    void forEachNeighbor(size_t block, const Visit& visit) const {
        const int columns = m_blocks.columns(), rows = m_blocks.rows();
        const int x = int(block % size_t(columns)), y = int(block / size_t(columns));
        for (int v = std::max(y - 1, 0); v <= std::min(y + 1, rows - 1); ++v)
            for (int u = std::max(x - 1, 0); u <= std::min(x + 1, columns - 1); ++u)
                visit(size_t(v) * size_t(columns) + size_t(u), float((u == x ? 2 : 1) * (v == y ? 2 : 1)));
    }
    /// The mean rays of a sample with a first vertex.
    float rays(size_t block) const { return m_rays[block]; }
    PixelBounds boundsOf(size_t block) const;
    /// Returns whether camera rays hit surfaces with emission brighter than 1. The noise of a background is
    /// in many blocks, so that pairs show it.
    bool seesLamps() const;
    /// Returns the noise of the render without sharing. The coefficient is that of lamps, 1.
    EmissionPilot emission() const;
    const Counters& counters() const { return m_counters; }
    const Brightness& brightness() const { return m_brightness; }

  private:
    class Worker;
    class State;
    struct Ranks;
    struct ThreadRenderer;
    bool isFirst(size_t block) const;
    template <class RanksOf>
    void render(const RanksOf& ranksOf);
    void addPixels(size_t block, const Ranks& ranks, std::vector<V2i>& out) const;
    template <class Visit>
    void forEachBlock(const PixelBounds& tile, const Visit& visit) const;
    void addCounters(const PixelBounds& tile, const Counters& counters);

    const RenderContext& m_context;
    const double m_samplesPerPixel;
    const SampleFactors m_blocks;
    std::vector<BlockNoise> m_halves[kHalves];
    std::vector<float> m_rays;
    std::mutex m_mutex; ///< of m_counters and m_brightness
    Counters m_counters;
    Brightness m_brightness;
    const std::unique_ptr<State> m_state;
    PerThread<ThreadRenderer> m_threads;
};

} // namespace strobe
