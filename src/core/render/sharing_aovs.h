// The AOVs of AovGroup::Sharing, and the reports of single samples.
#pragma once

#include "core/film/film.h"
#include "core/math/api.h"
#include "core/render/integrator.h"
#include "core/render/render_settings.h"

namespace STROBE_API strobe {

/// Derives sharing statistics from the requests of a batch. Requests without a hit, for direct light alone or
/// for an albedo do not count as shades. Buffers are reused from batch to batch.
class SharingAovs {
  public:
    /// Sets the film's layers for the pixels of a batch. Call it after the worker's
    /// `resolve`.
    void write(const VisibilityBatch& batch, const ShadingRequests& requests, const IntegratorWorker& worker,
               Film& film);
    /// Calls `onSample` with each sample in batch.filmSlice. `values` are the radiances of all samples of the
    /// batch.
    static void reportSamples(const VisibilityBatch& batch, const ShadingRequests& requests,
                              const IntegratorWorker& worker, std::span<const Rgb> values,
                              const std::function<void(const SampleRecord&)>& onSample);

  private:
    /// Statistics of one pixel.
    struct Tally {
        uint32_t hits = 0; ///< samples with a hit
        uint32_t shades = 0;
        uint32_t requestingSamples = 0; ///< samples that requested at least one shade
        double shadeTime = 0;           ///< sum of the shutter fractions of the shades
    };
    void tally(const VisibilityBatch& batch, const ShadingRequests& requests);
    /// Returns the value of a layer for pixel number `pixel` of the batch, after `tally`.
    float layerValue(Aov layer, size_t pixel, const VisibilityBatch& batch,
                     const IntegratorWorker& worker) const;

    std::vector<Tally> m_tallies; ///< per pixel of the batch
    std::vector<uint32_t> m_requestingSamples;
};

} // namespace strobe
