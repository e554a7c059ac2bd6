// Measurement of the cost of a shade while rendering.
#pragma once

#include "core/math/api.h"
#include "core/render/shader.h"
#include "core/scene/scene.h"

namespace STROBE_API strobe {

/// A shader worker that measures, in some of its batches, the cost of a shade per material. Timed batches are
/// sorted by material and shaded in packets of one material each. Timing does not change the radiance.
class TimedShader {
  public:
    /// `components` is LightComponents::count. The scene must outlive this object.
    TimedShader(const Scene& scene, std::unique_ptr<ShaderWorker> worker, size_t components);

    /// Times every `interval`-th batch, and batches 1, 16, 256, … for the sake of small images. Batch 0 is
    /// never timed, since it warms up caches.
    void timeEvery(uint32_t interval) { m_interval = interval; }
    /// See ShaderWorker::shade. Adds to counters.shadeCosts, which has an element per material and one for
    /// misses.
    void shade(const ShadingRequests& requests, const ShadeOutput& out, Counters& counters);

  private:
    void shadeTimed(const ShadingRequests& requests, const ShadeOutput& out, Counters& counters);
    void sortByMaterial(const ShadingRequests& requests);
    uint32_t costIndex(const Hit& hit) const;

    const Scene& m_scene;
    std::unique_ptr<ShaderWorker> m_worker;
    const size_t m_components;
    uint32_t m_interval = 256;
    uint32_t m_batchCount = 0;
    // Buffers of shadeTimed:
    std::vector<uint32_t> m_order;       ///< request indices, sorted by cost index
    std::vector<uint32_t> m_costIndices; ///< into Counters::shadeCosts, per request
    ShadingRequests m_packet;
    std::vector<Rgb> m_packetRadiance;
    std::vector<FirstVertex> m_packetVertices;
};

} // namespace strobe
