#include "core/render/sharing_aovs.h"

#include <algorithm>

namespace strobe {

namespace {

bool countsAsShade(const ShadingRequest& request) {
    return request.hit &&
           (request.component == LightComponent::All || request.component == LightComponent::Indirect);
}

} // namespace

void SharingAovs::tally(const VisibilityBatch& batch, const ShadingRequests& requests) {
    m_tallies.assign(batch.pixels.size(), {});
    for (const VisibilitySample& sample : batch.samples)
        m_tallies[sample.pixel].hits += bool(sample.hit);
    m_requestingSamples.clear();
    for (const ShadingRequest& request : requests) {
        if (!countsAsShade(request))
            continue;
        Tally& tally = m_tallies[batch.samples[request.sample].pixel];
        ++tally.shades;
        tally.shadeTime += request.ray.time;
        m_requestingSamples.push_back(request.sample);
    }
    std::sort(m_requestingSamples.begin(), m_requestingSamples.end());
    const auto end = std::unique(m_requestingSamples.begin(), m_requestingSamples.end());
    for (auto sample = m_requestingSamples.begin(); sample != end; ++sample)
        ++m_tallies[batch.samples[*sample].pixel].requestingSamples;
}

float SharingAovs::layerValue(Aov layer, size_t pixel, const VisibilityBatch& batch,
                              const IntegratorWorker& worker) const {
    const Tally& tally = m_tallies[pixel];
    switch (layer) {
    case Aov::Shades:
        return float(tally.shades);
    case Aov::Samples:
        return float(batch.filmSlice.count());
    case Aov::HitRate:
        return tally.hits ? 1 - float(tally.requestingSamples) / float(tally.hits) : 0;
    case Aov::Cell:
        return float(worker.sharingId(pixel * batch.slice.count()) >> 40);
    case Aov::ShadeTime:
        return tally.shades ? float(tally.shadeTime / tally.shades) : -1;
    default: // Renderer::finish and passes set the other layers
        return 0;
    }
}

void SharingAovs::write(const VisibilityBatch& batch, const ShadingRequests& requests,
                        const IntegratorWorker& worker, Film& film) {
    tally(batch, requests);
    for (size_t l = 0; l < film.layers().size(); ++l)
        for (size_t p = 0; p < batch.pixels.size(); ++p)
            film.setLayerValue(l, batch.pixels[p].x, batch.pixels[p].y,
                               layerValue(film.layers()[l], p, batch, worker));
}

void SharingAovs::reportSamples(const VisibilityBatch& batch, const ShadingRequests& requests,
                                const IntegratorWorker& worker, std::span<const Rgb> values,
                                const std::function<void(const SampleRecord&)>& onSample) {
    std::vector<uint32_t> shades(batch.samples.size());
    for (const ShadingRequest& request : requests)
        shades[request.sample] += countsAsShade(request);
    for (size_t i = 0; i < batch.samples.size(); ++i) {
        const VisibilitySample& sample = batch.samples[i];
        if (!batch.filmSlice.contains(sample.index))
            continue;
        const PixelRef& pixel = batch.pixels[sample.pixel];
        onSample({pixel.x, pixel.y, sample.index, sample, values[i], worker.sharingId(i), shades[i]});
    }
}

} // namespace strobe
