#include "sharing/rest_points.h"

namespace strobe {

float PixelSpread::of(const VisibilityBatch& batch, uint32_t pixel) const {
    alignas(64) static constexpr float kAtRest[kSoAWidth] = {};
    const int count = std::min(kSamples, int(batch.slice.count()));
    const uint32_t first = batch.sampleIndex(pixel, batch.slice.first);
    Hit hits[kSamples];
    V3f points[kSamples];
    HitSoA moving;
    int source[kSamples], movingCount = 0;
    for (int i = 0; i < count; ++i) {
        const VisibilitySoA& samples = batch.samples.chunk((first + uint32_t(i)) / kSoAWidth);
        const int lane = int((first + uint32_t(i)) % kSoAWidth);
        hits[i] = samples.hit.at(lane);
        if (!hits[i])
            continue;
        if (isStatic(m_scene, hits[i])) {
            points[i] = samples.ray.o.at(lane) + samples.ray.d.at(lane) * hits[i].t;
        } else {
            moving.set(movingCount, hits[i]);
            source[movingCount++] = i;
        }
    }
    if (movingCount > 0) {
        SurfaceSoA rest;
        m_scene.rawSurfaces(moving, kAtRest, movingCount, rest);
        for (int k = 0; k < movingCount; ++k) {
            RawSurfacePoint point = rest.at(k);
            point.finish();
            points[source[k]] = point.p;
        }
    }
    const PixelRef& at = batch.pixels[pixel];
    const RayCone cone = m_scene.camera().cone(V2f(float(at.x) + 0.5f, float(at.y) + 0.5f));
    float distance = 0, width = 0;
    for (int i = 1; i < count; ++i)
        if (hits[i] && hits[i].geometry == hits[i - 1].geometry && hits[i].instance == hits[i - 1].instance) {
            distance += length(points[i] - points[i - 1]);
            width += cone.width + cone.spread * hits[i].t;
        }
    return width > 0 ? distance / width : 0;
}

} // namespace strobe
