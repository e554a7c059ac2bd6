// Rays waiting to fill a packet, each with what to do when its answer is known.
#pragma once

#include "core/scene.h"

namespace strobe {

/// Occlusion rays with the light they carry. `visible(target, contribution)` is called, in the order of
/// `add`, for those that get through.
template <class Visible>
class ShadowQueue {
  public:
    ShadowQueue(const Tracer& tracer, uint64_t& counter, Visible visible)
        : m_tracer(tracer), m_counter(counter), m_visible(visible) {}
    void add(const Ray& ray, float tmax, uint32_t target, const Rgb& contribution) {
        m_block.set(m_count, ray.o, ray.d, ray.tmin, tmax, ray.time);
        m_target[m_count] = target;
        m_contribution[m_count] = contribution;
        if (++m_count == RayBlock::kSize)
            flush();
    }
    void flush() {
        if (m_count == 0)
            return;
        m_tracer.occluded(m_block, m_count);
        m_counter += uint64_t(m_count);
        for (int i = 0; i < m_count; ++i)
            if (m_block.tfar[i] >= 0)
                m_visible(m_target[i], m_contribution[i]);
        m_count = 0;
    }

  private:
    const Tracer& m_tracer;
    uint64_t& m_counter;
    Visible m_visible;
    int m_count = 0;
    uint32_t m_target[RayBlock::kSize];
    Rgb m_contribution[RayBlock::kSize];
    RayBlock m_block;
};

/// Nearest-hit rays with a payload. `found(payload, hit)` is called in the order of `add`.
template <class Payload, class Found>
class HitQueue {
  public:
    HitQueue(const Tracer& tracer, uint64_t& counter, Found found)
        : m_tracer(tracer), m_counter(counter), m_found(found) {}
    void add(const Ray& ray, const Payload& payload) {
        m_block.set(m_count, ray.o, ray.d, ray.tmin, kInfinity, ray.time);
        m_payload[m_count] = payload;
        if (++m_count == RayBlock::kSize)
            flush();
    }
    void flush() {
        if (m_count == 0)
            return;
        m_tracer.intersect(m_block, m_count, false);
        m_counter += uint64_t(m_count);
        for (int i = 0; i < m_count; ++i)
            m_found(m_payload[i], m_tracer.hit(m_block, i));
        m_count = 0;
    }

  private:
    const Tracer& m_tracer;
    uint64_t& m_counter;
    Found m_found;
    int m_count = 0;
    Payload m_payload[RayBlock::kSize];
    RayBlock m_block;
};

} // namespace strobe
