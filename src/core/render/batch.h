// What goes through the steps of a batch: visibility samples and shading requests, kept side by side.
#pragma once

#include "core/interfaces/camera.h"
#include "core/scene/tracer.h"

#include <span>
#include <vector>

namespace strobe {

class Scene;

/// A sequence of what `Lanes` keeps side by side, kLanes in each. Members are put together when looked at,
/// from those of their numbers that are used. It keeps its memory when it shrinks.
template <class Lanes>
class LaneSequence {
  public:
    using Value = decltype(std::declval<const Lanes&>().at(0));

    size_t size() const { return m_size; }
    void clear() { m_size = 0; }
    /// What is new has to be set before it is looked at.
    void resize(size_t size) {
        m_size = size;
        if (blocks() > m_lanes.size())
            m_lanes.resize(blocks());
    }
    void push_back(const Value& value) {
        resize(m_size + 1);
        m_lanes[(m_size - 1) / kLanes].set(int((m_size - 1) % kLanes), value);
    }
    Value operator[](size_t i) const { return m_lanes[i / kLanes].at(int(i % kLanes)); }

    /// Block b has the members from b * kLanes on, as many as `inBlock` says.
    size_t blocks() const { return (m_size + kLanes - 1) / kLanes; }
    int inBlock(size_t b) const { return int(std::min<size_t>(kLanes, m_size - b * kLanes)); }
    Lanes& block(size_t b) { return m_lanes[b]; }
    const Lanes& block(size_t b) const { return m_lanes[b]; }

    class Iterator {
      public:
        Iterator(const LaneSequence& all, size_t i) : m_all(all), m_i(i) {}
        Value operator*() const { return m_all[m_i]; }
        Iterator& operator++() { return ++m_i, *this; }
        bool operator!=(const Iterator& other) const { return m_i != other.m_i; }

      private:
        const LaneSequence& m_all;
        size_t m_i;
    };
    Iterator begin() const { return {*this, 0}; }
    Iterator end() const { return {*this, m_size}; }

  private:
    size_t m_size = 0;
    std::vector<Lanes> m_lanes;
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

struct VisibilityLanes {
    HitLanes hit;
    CameraSampleLanes camera;
    CameraRayLanes ray;
    alignas(64) float weight[kLanes];
    alignas(64) uint32_t pixel[kLanes], index[kLanes];
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
    const LaneSequence<VisibilityLanes>& samples;
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
enum class LightPart : uint8_t { All, Direct, Indirect, Albedo };

/// A place to shade: a surface point (or the emptiness) as seen along a ray.
struct ShadingRequest {
    Hit hit;
    Ray ray;         ///< towards the surface; its time is the time of shading, its tmin does not count
    RayCone cone;    ///< at the ray's origin
    uint64_t domain; ///< sampler set of the random numbers: member `index` of `total`
    uint32_t index, total;
    uint32_t sample; ///< the sample of the batch that asked for it; shading does not look at it
    LightPart part = LightPart::All;
};

struct RequestLanes {
    HitLanes hit;
    CameraRayLanes ray;
    alignas(64) float time[kLanes], width[kLanes], spread[kLanes]; ///< the latter of the cone
    alignas(64) uint64_t domain[kLanes];
    alignas(64) uint32_t index[kLanes], total[kLanes], sample[kLanes];
    alignas(64) LightPart part[kLanes];
    ShadingRequest at(int i) const {
        return {hit.at(i),
                {ray.o.at(i), ray.d.at(i), time[i]},
                {width[i], spread[i]},
                domain[i],
                index[i],
                total[i],
                sample[i],
                part[i]};
    }
    void set(int i, const ShadingRequest& r) {
        hit.set(i, r.hit), ray.o.set(i, r.ray.o), ray.d.set(i, r.ray.d);
        time[i] = r.ray.time, width[i] = r.cone.width, spread[i] = r.cone.spread;
        domain[i] = r.domain, index[i] = r.index, total[i] = r.total, sample[i] = r.sample, part[i] = r.part;
    }
};
using ShadingRequests = LaneSequence<RequestLanes>;

/// The request that a visibility sample would make for itself.
ShadingRequest requestFor(const Scene& scene, const VisibilityBatch& batch, const VisibilitySample& sample);
/// Those of all samples of the batch, in their order; `requests` is empty at the call.
void requestForEach(const Scene& scene, const VisibilityBatch& batch, ShadingRequests& requests);

} // namespace strobe
