#include "core/batch.h"

#include "core/scene.h"

#include <numeric>

namespace strobe {

ShadingRequest requestFor(const Scene& scene, const VisibilityBatch& batch, const VisibilitySample& sample) {
    return {sample.hit,
            sample.ray,
            scene.needsFootprint() ? scene.camera().cone(sample.film) : RayCone{},
            batch.pixels[sample.pixel].domain,
            sample.index,
            batch.samplesPerPixel,
            batch.placeOf(sample.pixel, sample.index)};
}

void requestForEach(const Scene& scene, const VisibilityBatch& batch, ShadingRequests& requests) {
    requests.resize(batch.samples.size());
    for (size_t b = 0; b < requests.blocks(); ++b) {
        const VisibilityLanes& from = batch.samples.block(b);
        RequestLanes& to = requests.block(b);
        to.hit = from.hit, to.ray = from.ray;
        std::copy_n(from.camera.time, kLanes, to.time);
        std::copy_n(from.index, kLanes, to.index);
        std::fill_n(to.total, kLanes, batch.samplesPerPixel);
        std::iota(to.sample, to.sample + kLanes, uint32_t(b * kLanes));
        std::fill_n(to.part, kLanes, LightPart::All);
        for (int i = 0; i < requests.inBlock(b); ++i)
            to.domain[i] = batch.pixels[from.pixel[i]].domain;
        for (int i = 0; i < requests.inBlock(b); ++i) {
            const RayCone cone =
                scene.needsFootprint() ? scene.camera().cone(from.camera.film.at(i)) : RayCone{};
            to.width[i] = cone.width, to.spread[i] = cone.spread;
        }
    }
}

} // namespace strobe
