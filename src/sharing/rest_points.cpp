#include "sharing/rest_points.h"

#include "core/math/hash.h"

#include <cmath>

namespace strobe {

V3f shadingNormalAtRest(const FirstVertex& vertex, const RawSurfacePoint& rest) {
    const float side = vertex.isFront ? 1.f : -1.f;
    if (!vertex.hasMappedNormal)
        return rest.ns * side;
    const Frame from = Frame::fromNormalTangent(vertex.n, vertex.dpdu);
    return Frame::fromNormalTangent(rest.ng * side, rest.dpdu).toWorld(from.toLocal(vertex.ns));
}

uint64_t surfaceOfTilt(uint64_t surface, const V3f& n, const V3f& ns) {
    // Measured: half as much is better at 16 samples, but leaves more noise at 4.
    constexpr float kStep = 0.65f;
    const V3f tilt = (ns - n) * (1 / kStep);
    const auto group = [](float x) { return int64_t(std::nearbyint(x)); };
    const int64_t x = group(tilt.x), y = group(tilt.y), z = group(tilt.z);
    return x == 0 && y == 0 && z == 0 ? surface : fastHashOf(surface, x, y, z);
}

/// The camera hits at rest of the first samples of a pixel.
struct PixelSpread::Points {
    static constexpr int kMax = 16;

    int count = 0;
    alignas(64) uint32_t instance[kMax], geometry[kMax]; ///< see Hit
    alignas(64) float x[kMax], y[kMax], z[kMax];
    alignas(64) float coneWidth[kMax]; ///< of the pixel, at the hit

    /// Copies the hits of `n` samples from sample `first` of a chunk on to `target` and the points after it,
    /// as if their surfaces rest.
    void copyHits(const VisibilitySoA& samples, int first, int n, const RayCone& cone, int target);
    /// Writes the distance of each point, but for the first, from the one before, and the width of its cone;
    /// zeros if they lie on different surfaces.
    void measureSteps(float* distance, float* width) const;
};

STROBE_TARGET_CLONES void PixelSpread::Points::copyHits(const VisibilitySoA& samples, int first, int n,
                                                        const RayCone& cone, int target) {
    STROBE_IVDEP
    for (int k = 0; k < n; ++k) {
        const int i = first + k, o = target + k;
        const float t = samples.hit.t[i];
        instance[o] = samples.hit.instance[i];
        geometry[o] = samples.hit.geometry[i];
        coneWidth[o] = cone.width + cone.spread * t;
        x[o] = samples.ray.o.x[i] + samples.ray.d.x[i] * t;
        y[o] = samples.ray.o.y[i] + samples.ray.d.y[i] * t;
        z[o] = samples.ray.o.z[i] + samples.ray.d.z[i] * t;
    }
}

STROBE_TARGET_CLONES void PixelSpread::Points::measureSteps(float* distance, float* width) const {
    STROBE_IVDEP
    for (int i = 1; i < count; ++i) {
        const bool counts =
            instance[i] == instance[i - 1] && geometry[i] == geometry[i - 1] && geometry[i] != kNone;
        const float dx = x[i] - x[i - 1], dy = y[i] - y[i - 1], dz = z[i] - z[i - 1];
        distance[i] = counts ? std::sqrt(dx * dx + dy * dy + dz * dz) : 0;
        width[i] = counts ? coneWidth[i] : 0;
    }
}

float PixelSpread::of(const VisibilityBatch& batch, uint32_t pixel) const {
    Points points;
    points.count = std::min(Points::kMax, int(batch.slice.count()));
    const uint32_t first = batch.sampleIndex(pixel, batch.slice.first);
    const PixelRef& at = batch.pixels[pixel];
    const RayCone cone = m_scene.camera().cone(V2f(float(at.x) + 0.5f, float(at.y) + 0.5f));
    for (int i = 0, n; i < points.count; i += n) {
        const uint32_t sample = first + uint32_t(i);
        const int lane = int(sample % kSoAWidth);
        n = std::min(points.count - i, kSoAWidth - lane);
        points.copyHits(batch.samples.chunk(sample / kSoAWidth), lane, n, cone, i);
    }
    if (m_scene.moves())
        replaceMoving(batch, first, points);
    alignas(64) float distance[Points::kMax] = {}, width[Points::kMax] = {};
    points.measureSteps(distance, width);
    float distances = 0, widths = 0;
    for (int i = 1; i < points.count; ++i) {
        distances += distance[i];
        widths += width[i];
    }
    return widths > 0 ? distances / widths : 0;
}

/// Replaces the points on surfaces that move.
void PixelSpread::replaceMoving(const VisibilityBatch& batch, uint32_t firstSample, Points& points) const {
    MovingHits moving;
    bool isMoving = false;
    for (int i = 0; i < points.count; ++i) {
        if (points.geometry[i] == kNone)
            continue;
        const uint32_t sample = firstSample + uint32_t(i);
        const HitSoA& hits = batch.samples.chunk(sample / kSoAWidth).hit;
        if (i == 0 || points.instance[i] != points.instance[i - 1] ||
            points.geometry[i] != points.geometry[i - 1])
            isMoving = !isStatic(m_scene, hits.at(int(sample % kSoAWidth)));
        if (isMoving)
            moving.add(hits.at(int(sample % kSoAWidth)), i);
    }
    moving.forEachAtRest(m_scene, [&](int i, const RawSurfacePoint& point) {
        points.x[i] = point.p.x;
        points.y[i] = point.p.y;
        points.z[i] = point.p.z;
    });
}

} // namespace strobe
