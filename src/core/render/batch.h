// What goes through the steps of a batch: visibility samples and shading requests, kept side by side.
#pragma once

#include "core/interfaces/camera.h"
#include "core/scene/tracer.h"

#include <span>
#include <vector>

namespace strobe {

class Scene;

/// A vector of values that are stored as structures of arrays, kSoAWidth values to a chunk. An element is
/// assembled when it is read. Shrinking keeps the memory.
template <class SoA>
class SoAVector {
  public:
    using Value = decltype(std::declval<const SoA&>().at(0));

    size_t size() const { return m_size; }
    void clear() { m_size = 0; }
    /// New elements are uninitialized.
    void resize(size_t size) {
        m_size = size;
        if (chunks() > m_chunks.size())
            m_chunks.resize(chunks());
    }
    void push_back(const Value& value) {
        resize(m_size + 1);
        m_chunks[(m_size - 1) / kSoAWidth].set(int((m_size - 1) % kSoAWidth), value);
    }
    Value operator[](size_t i) const { return m_chunks[i / kSoAWidth].at(int(i % kSoAWidth)); }

    size_t chunks() const { return (m_size + kSoAWidth - 1) / kSoAWidth; }
    /// How many elements chunk `c` has; the first is number c * kSoAWidth.
    int chunkSize(size_t c) const { return int(std::min<size_t>(kSoAWidth, m_size - c * kSoAWidth)); }
    SoA& chunk(size_t c) { return m_chunks[c]; }
    const SoA& chunk(size_t c) const { return m_chunks[c]; }

    class Iterator {
      public:
        Iterator(const SoAVector& all, size_t i) : m_all(all), m_i(i) {}
        Value operator*() const { return m_all[m_i]; }
        Iterator& operator++() { return ++m_i, *this; }
        bool operator!=(const Iterator& other) const { return m_i != other.m_i; }

      private:
        const SoAVector& m_all;
        size_t m_i;
    };
    Iterator begin() const { return {*this, 0}; }
    Iterator end() const { return {*this, m_size}; }

  private:
    size_t m_size = 0;
    std::vector<SoA> m_chunks;
};

/// One camera ray and what it met.
struct VisibilitySample {
    Hit hit;
    Ray ray;
    V2f film;       ///< film position, in pixels of the full frame
    float weight;   ///< of the pixel filter: plus or minus the same number for all samples of a render
    uint32_t pixel; ///< index into VisibilityBatch::pixels
    uint32_t index; ///< of the sample in its pixel
};

struct VisibilitySoA {
    HitSoA hit;
    CameraSampleSoA camera;
    CameraRaySoA ray;
    alignas(64) float weight[kSoAWidth];
    alignas(64) uint32_t pixel[kSoAWidth], index[kSoAWidth];
    VisibilitySample at(int i) const {
        return {hit.at(i), {ray.o.at(i), ray.d.at(i), camera.time[i]}, camera.film.at(i), weight[i], pixel[i],
                index[i]};
    }
};

struct PixelRef {
    int x, y;
    uint64_t domain; ///< the sampler domain of the pixel: a hash of seed and position
};

/// Some of a pixel's samples: numbers `first` to `end`, without the latter.
struct SampleSlice {
    uint32_t first = 0, end = 0;
    uint32_t count() const { return end - first; }
    bool contains(uint32_t index) const { return first <= index && index < end; }
    bool operator==(const SampleSlice&) const = default;
};

/// Visibility samples of a few pixels, pixel by pixel, samples in order: the same `slice` of each.
struct VisibilityBatch {
    std::span<const PixelRef> pixels;
    const SoAVector<VisibilitySoA>& samples;
    uint32_t samplesPerPixel = 0; ///< of the whole render
    SampleSlice slice;  ///< of each pixel: what is here. All of them, if samples depend on their pixel
    SampleSlice wanted; ///< a part of it: the values of others are not looked at

    /// The index among `samples` of sample `index` of a pixel.
    uint32_t placeOf(uint32_t pixel, uint32_t index) const {
        return pixel * slice.count() + index - slice.first;
    }
};

/// Which of the light to estimate. Direct: what lights the first surface beyond mirrors and glass, and what
/// that surface and the emptiness emit. Indirect: the rest, of a first surface that is neither mirror nor
/// glass. Their sum is all; but where the first surface's material is textured, Indirect is divided by its
/// albedo there, so that it can be carried to other points. Albedo asks for theirs, and for no light.
enum class LightComponent : uint8_t { All, Direct, Indirect, Albedo };

/// How radiance is to be split, besides its whole: into direct and indirect light (see LightComponent; what
/// is seen in mirrors and glass included), and by the groups of the lights that it comes from.
struct LightComponents {
    bool byBounce = false;
    int groups = 0; ///< 0: not by groups
    /// Parts per request: direct, indirect, then each group; those that are asked for.
    int count() const { return (byBounce ? 2 : 0) + groups; }
};

/// A place to shade: a surface point (or the emptiness) as seen along a ray.
struct ShadingRequest {
    Hit hit;
    Ray ray;         ///< towards the surface; its time is the time of shading, its tmin does not count
    RayCone cone;    ///< at the ray's origin
    uint64_t domain; ///< sampler set of the random numbers: member `index` of `total`
    uint32_t index, total;
    uint32_t sample; ///< the sample of the batch that asked for it; shading does not look at it
    LightComponent component = LightComponent::All;
};

struct RequestSoA {
    HitSoA hit;
    CameraRaySoA ray;
    alignas(64) float time[kSoAWidth], width[kSoAWidth], spread[kSoAWidth]; ///< the latter of the cone
    alignas(64) uint64_t domain[kSoAWidth];
    alignas(64) uint32_t index[kSoAWidth], total[kSoAWidth], sample[kSoAWidth];
    alignas(64) LightComponent component[kSoAWidth];
    ShadingRequest at(int i) const {
        return {hit.at(i),
                {ray.o.at(i), ray.d.at(i), time[i]},
                {width[i], spread[i]},
                domain[i],
                index[i],
                total[i],
                sample[i],
                component[i]};
    }
    void set(int i, const ShadingRequest& r) {
        hit.set(i, r.hit), ray.o.set(i, r.ray.o), ray.d.set(i, r.ray.d);
        time[i] = r.ray.time, width[i] = r.cone.width, spread[i] = r.cone.spread;
        domain[i] = r.domain, index[i] = r.index, total[i] = r.total, sample[i] = r.sample,
        component[i] = r.component;
    }
};
using ShadingRequests = SoAVector<RequestSoA>;

/// The request that a visibility sample would make for itself.
ShadingRequest requestFor(const Scene& scene, const VisibilityBatch& batch, const VisibilitySample& sample);
/// Those of all samples of the batch, in their order; `requests` is empty at the call.
void requestForEach(const Scene& scene, const VisibilityBatch& batch, ShadingRequests& requests);

} // namespace strobe
