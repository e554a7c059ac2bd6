#include "core/render/batch.h"

#include "core/scene/scene.h"

namespace strobe {

ShadingRequest requestFor(const Scene& scene, const VisibilityBatch& batch, const VisibilitySample& sample) {
    return {sample.hit,
            sample.ray,
            scene.camera().cone(sample.film),
            batch.pixels[sample.pixel].domain,
            sample.index,
            batch.samplesPerPixel,
            batch.sampleIndex(sample.pixel, sample.index)};
}

namespace {

/// Copies the members that a sample and its request have in common. `first` is the index of the first sample.
STROBE_TARGET_CLONES void copySamples(const VisibilitySoA& from, uint32_t first, uint32_t total,
                                      RequestSoA& to) {
    STROBE_IVDEP
    for (int i = 0; i < kSoAWidth; ++i) {
        to.hit.instance[i] = from.hit.instance[i];
        to.hit.geometry[i] = from.hit.geometry[i];
        to.hit.prim[i] = from.hit.prim[i];
        to.hit.u[i] = from.hit.u[i];
        to.hit.v[i] = from.hit.v[i];
        to.hit.t[i] = from.hit.t[i];
        to.ray.o.x[i] = from.ray.o.x[i];
        to.ray.o.y[i] = from.ray.o.y[i];
        to.ray.o.z[i] = from.ray.o.z[i];
        to.ray.d.x[i] = from.ray.d.x[i];
        to.ray.d.y[i] = from.ray.d.y[i];
        to.ray.d.z[i] = from.ray.d.z[i];
        to.time[i] = from.camera.time[i];
        to.index[i] = from.index[i];
        to.total[i] = total;
        to.sample[i] = first + uint32_t(i);
        to.component[i] = LightComponent::All;
    }
}

} // namespace

void requestForEach(const Scene& scene, const VisibilityBatch& batch, ShadingRequests& requests) {
    requests.resize(batch.samples.size());
    for (size_t c = 0; c < requests.chunks(); ++c) {
        const VisibilitySoA& from = batch.samples.chunk(c);
        RequestSoA& to = requests.chunk(c);
        copySamples(from, uint32_t(c * kSoAWidth), batch.samplesPerPixel, to);
        const uint32_t n = uint32_t(requests.chunkSize(c));
        for (uint32_t i = 0, run; i < n; i += run) { // runs of samples of one pixel
            run = std::min(n - i, batch.slice.count() - (from.index[i] - batch.slice.first));
            std::fill_n(to.domain + i, run, batch.pixels[from.pixel[i]].domain);
        }
        scene.camera().coneSoA(from.camera.film, requests.chunkSize(c), to.width, to.spread);
    }
}

} // namespace strobe
