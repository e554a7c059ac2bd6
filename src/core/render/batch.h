// Batches of visibility samples and shading requests, stored as structures of arrays.
#pragma once

#include "core/interfaces/camera.h"
#include "core/math/api.h"
#include "core/math/sample_slice.h"
#include "core/scene/tracer.h"

#include <span>
#include <vector>

namespace STROBE_API strobe {

class Scene;

/// A vector whose elements are stored as structures of arrays, in chunks of kSoAWidth elements. `operator[]`
/// and iterators return copies. Shrinking keeps the memory.
template <class SoA>
class SoAVector {
  public:
    using Value = decltype(std::declval<const SoA&>().at(0));

    size_t size() const { return m_size; }
    void clear() { m_size = 0; }
    /// Leaves new elements uninitialized.
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

    /// Returns the number of chunks.
    size_t chunks() const { return (m_size + kSoAWidth - 1) / kSoAWidth; }
    /// Returns the number of elements in chunk `c`; its first element has the index c * kSoAWidth.
    int chunkSize(size_t c) const { return int(std::min<size_t>(kSoAWidth, m_size - c * kSoAWidth)); }
    SoA& chunk(size_t c) { return m_chunks[c]; }
    const SoA& chunk(size_t c) const { return m_chunks[c]; }

    class Iterator {
      public:
        Iterator(const SoAVector& vector, size_t index) : m_vector(vector), m_index(index) {}
        Value operator*() const { return m_vector[m_index]; }
        Iterator& operator++() {
            ++m_index;
            return *this;
        }
        bool operator!=(const Iterator& other) const { return m_index != other.m_index; }

      private:
        const SoAVector& m_vector;
        size_t m_index;
    };
    Iterator begin() const { return {*this, 0}; }
    Iterator end() const { return {*this, m_size}; }

  private:
    size_t m_size = 0;
    std::vector<SoA> m_chunks;
};

/// One camera ray and its hit.
struct VisibilitySample {
    Hit hit;
    Ray ray;
    V2f film;       ///< film position, in pixels of the full frame
    float weight;   ///< of the pixel filter: 1 or -1
    uint32_t pixel; ///< index into VisibilityBatch::pixels
    uint32_t index; ///< of the sample in its pixel
};

/// VisibilitySamples as a structure of arrays.
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

/// A pixel of a batch.
struct PixelRef {
    int x, y;        ///< in the full frame
    uint64_t domain; ///< of the pixel's samples (see SampleRange): a hash of the seed and the position
};

/// Visibility samples of a few pixels: pixel by pixel, the same slice of each pixel, in ascending order. The
/// pixels are near each other within a tile; which of them are in one batch depends on the tile and on the
/// number of samples per pixel.
struct VisibilityBatch {
    std::span<const PixelRef> pixels;
    const SoAVector<VisibilitySoA>& samples;
    uint32_t samplesPerPixel = 0; ///< of these pixels in the whole render
    SampleSlice slice;         ///< the samples of each pixel in the batch; all, if they depend on their pixel
    SampleSlice filmSlice;     ///< the samples of each pixel whose values are used; a subset of `slice`
    uint32_t sampleFactor = 1; ///< of the pixels, contained in the numbers above; see SampleFactors

    /// Returns the index in `samples` of sample number `index` of a pixel.
    uint32_t sampleIndex(uint32_t pixel, uint32_t index) const {
        return pixel * slice.count() + index - slice.first;
    }
};

/// The component of light to estimate. Direct: emission and direct illumination at the first vertex that is
/// neither mirror nor glass, and the background. Indirect: all other radiance, for hits that are neither
/// mirror nor glass; if the material is textured, it is divided by the albedo at the hit, so that it can be
/// reused at other points. Albedo: this albedo, and no radiance.
enum class LightComponent : uint8_t { All, Direct, Indirect, Albedo };

/// The components into which a shade splits its radiance, in addition to the whole: direct and indirect light
/// (see LightComponent; here, including light seen through mirrors and glass), and the light of each group.
struct LightComponents {
    bool byBounce = false; ///< direct and indirect
    int groups = 0;        ///< the number of light groups; 0: no split by groups
    /// Returns the number of components. Their order is direct, indirect, then the groups.
    int count() const { return (byBounce ? 2 : 0) + groups; }
};

/// The input of one shade: a hit (or a miss) seen along a ray.
struct ShadingRequest {
    Hit hit;
    Ray ray;         ///< towards the hit; ray.time is the time of shading, ray.tmin is unused
    RayCone cone;    ///< at the ray's origin
    uint64_t domain; ///< of the random numbers: sample `index` of `total`, see SampleRange
    uint32_t index, total;
    uint32_t sample; ///< index of the sample of the batch that made the request; not read by shaders
    LightComponent component = LightComponent::All;
};

/// ShadingRequests as a structure of arrays.
struct RequestSoA {
    HitSoA hit;
    CameraRaySoA ray;
    alignas(64) float time[kSoAWidth];
    alignas(64) float width[kSoAWidth], spread[kSoAWidth]; ///< of the cone
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
        hit.set(i, r.hit);
        ray.o.set(i, r.ray.o);
        ray.d.set(i, r.ray.d);
        time[i] = r.ray.time;
        width[i] = r.cone.width;
        spread[i] = r.cone.spread;
        domain[i] = r.domain;
        index[i] = r.index;
        total[i] = r.total;
        sample[i] = r.sample;
        component[i] = r.component;
    }
};
using ShadingRequests = SoAVector<RequestSoA>;

/// Returns the request that shades exactly one visibility sample: its hit, its ray and its random numbers.
ShadingRequest requestFor(const Scene& scene, const VisibilityBatch& batch, const VisibilitySample& sample);
/// Writes the request of each sample of the batch, in order. Precondition: `requests` is empty.
void requestForEach(const Scene& scene, const VisibilityBatch& batch, ShadingRequests& requests);

} // namespace strobe
