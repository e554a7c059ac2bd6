// The errors of sharing in blocks of pixels.
#pragma once

#include "core/render/integrator.h"
#include "core/util/parallel.h"
#include "sharing/records/light_units.h"

#include <array>
#include <memory>
#include <vector>

namespace strobe {

/// The sets of parts of the light to choose from: none, one, or both.
inline const LightParts kSharingChoices[] = {LightParts(0), LightParts(1), LightParts(2), LightParts(3)};
inline constexpr size_t kSharesDirect = 1, kSharesIndirect = 2, kSharesBoth = 3, kSharingChoiceCount = 4;

/// The measurements of one block. Errors are squared, sums over pixels and channels, relative to the
/// radiance.
struct BlockPilot {
    PixelBounds bounds{};
    double weight = 1; ///< of the block's sums: in proportion to the inverse of the probability to choose it
    /// The errors of the images that share the parts of kSharingChoices, of radiance clipped to 1: variance
    /// and squared bias of means over windows.
    double errors[kSharingChoiceCount] = {};
    // Sums over the pixels of one render:
    double sharedVariance = 0; ///< that LightSharing estimates if both parts are shared; not relative
    double pixels = 0;
    double cells = 0;               ///< that were recorded
    double emissionCoefficient = 0; ///< see strobe::emissionCoefficient
};

/// Renders blocks of a scene. Thread-safe.
class BlockRenderer {
  public:
    /// `parts`: those that may be shared; the others are black.
    BlockRenderer(const Scene& scene, const RenderContext& context, int samplesPerPixel, float cellSize,
                  LightParts parts);
    ~BlockRenderer();
    /// Renders a block with two seeds and sets its measurements.
    void render(const std::array<uint64_t, 2>& seeds, BlockPilot& block);

  private:
    class ThreadPilot;
    using Images = std::array<std::vector<Rgb>, kSharingChoiceCount>;
    Images renderOnce(uint64_t seed, BlockPilot& block);

    const Scene& m_scene;
    const RenderContext& m_context;
    const int m_samplesPerPixel;
    const float m_cellSize;
    const LightParts m_parts;
    PerThread<ThreadPilot> m_threads;
};

} // namespace strobe
