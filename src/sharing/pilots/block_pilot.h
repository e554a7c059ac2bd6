// The errors of sharing in blocks of pixels.
#pragma once

#include "core/render/integrator.h"
#include "core/util/parallel.h"
#include "sharing/records/light_units.h"

#include <memory>
#include <vector>

namespace strobe {

/// The sets of parts of the light to choose from: none, one, or both.
inline const LightParts kSharingChoices[] = {LightParts(0), LightParts(1), LightParts(2), LightParts(3)};
inline constexpr size_t kSharesDirect = 1, kSharesIndirect = 2, kSharesBoth = 3, kSharingChoiceCount = 4;

/// The errors are measured twice, with radiance clipped to each of these values. Unclipped errors contain
/// those of rare bright samples. Errors of radiance clipped to 1 are less noisy.
inline constexpr float kErrorClips[] = {INFINITY, 1};
inline constexpr size_t kErrorClipCount = 2;

/// The measurements of one block. Errors are squared, sums over the pixels, relative to the radiance.
struct BlockPilot {
    PixelBounds bounds{};
    double weight = 1; ///< of the block's sums: in proportion to the inverse of the probability to choose it
    /// The errors of the images that share the parts of kSharingChoices, by kErrorClips.
    double errors[kErrorClipCount][kSharingChoiceCount] = {};
    /// The errors that LightSharing estimates for both parts, without sharing and with it; of one render.
    double ownVariance = 0, variance = 0;
    // Sums over the pixels of one render:
    double absoluteVariance = 0; ///< `variance`, not relative
    double pixels = 0;
    double cells = 0;                             ///< that were recorded
    double emissionCoefficient = 0;               ///< see strobe::emissionCoefficient
    std::vector<Rgb> images[kSharingChoiceCount]; ///< of the first render
};

/// Renders blocks of a scene. Thread-safe.
class BlockRenderer {
  public:
    /// `parts`: those that may be shared; the others are black.
    BlockRenderer(const Scene& scene, const RenderContext& context, int samplesPerPixel, float cellSize,
                  LightParts parts);
    ~BlockRenderer();
    /// Renders a block. Sets all of `block` but its errors.
    void renderFirst(uint64_t seed, BlockPilot& block);
    /// Renders a block again and measures the errors of sharing: see addErrors.
    void renderSecond(uint64_t seed, BlockPilot& block);

  private:
    class ThreadPilot;
    void render(uint64_t seed, BlockPilot& block, std::vector<Rgb> (&images)[kSharingChoiceCount]);

    const Scene& m_scene;
    const RenderContext& m_context;
    const int m_samplesPerPixel;
    const float m_cellSize;
    const LightParts m_parts;
    PerThread<ThreadPilot> m_threads;
};

} // namespace strobe
