// Generation and tracing of camera samples.
#pragma once

#include "core/math/api.h"
#include "core/math/filter_signs.h"
#include "core/render/batch.h"
#include "core/scene/scene.h"

namespace STROBE_API strobe {

/// Generates the camera samples of pixels and traces their rays, on one thread.
class VisibilityTracer {
  public:
    /// `slice`: the samples of each pixel, of `samplesPerPixel`. `samplesBefore`: see RenderSettings. Scene,
    /// sampler and filter must outlive this object.
    VisibilityTracer(const Scene& scene, const Sampler& sampler, const Filter& filter,
                     uint32_t samplesPerPixel, const SampleSlice& slice, uint64_t samplesBefore = 0);
    /// Writes all members of the samples of `pixels` but the hits, pixel by pixel. `samples` belongs to this
    /// tracer: members that are the same in each batch are written only when it grows.
    void generate(std::span<const PixelRef> pixels, SoAVector<VisibilitySoA>& samples);
    /// Writes the hits.
    void trace(SoAVector<VisibilitySoA>& samples);

  private:
    void initialize(VisibilitySoA& chunk, size_t index) const;
    void generateChunk(std::span<const PixelRef> pixels, uint32_t first, int n, VisibilitySoA& out);
    void moveToNegativeLobes(std::span<const PixelRef> pixels, int n, const VisibilitySoA& chunk,
                             V2SoA& offset) const;

    const Scene& m_scene;
    const Sampler& m_sampler;
    const Filter& m_filter;
    const FilterSigns m_signs;
    const bool m_moves; ///< false: all samples have time 0.5
    const uint32_t m_samplesPerPixel;
    const SampleSlice m_slice;
    const uint64_t m_samplesBefore;
    size_t m_initializedChunks = 0;
    // Buffers:
    std::vector<SampleRange> m_ranges;
    RayPacket m_packet;
};

} // namespace strobe
