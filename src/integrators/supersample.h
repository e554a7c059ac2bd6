// The baseline: one shade per visibility sample. The simplest integrator, as an example of the interface
// (core/render/integrator.h).
#pragma once

#include "core/render/batch.h"
#include "core/render/integrator.h"

namespace strobe {

/// Maps each visibility sample of a batch to a shading request of its own. Each thread has a worker.
class SupersampleWorker : public IntegratorWorker {
  public:
    explicit SupersampleWorker(const Scene& scene) : m_scene(scene) {}

    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override {
        requestForEach(m_scene, batch, requests);
    }

    /// Request i is that of sample i, so the shaded values are the result.
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded,
                                 std::span<Rgb>) override {
        return shaded;
    }

  private:
    const Scene& m_scene;
};

IntegratorPlugin supersamplePlugin();

} // namespace strobe
