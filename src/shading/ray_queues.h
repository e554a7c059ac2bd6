// Rays waiting to fill a packet, each with what to do when its answer is known.
#pragma once

#include "shading/vertex_soa.h"

#include <utility>

namespace strobe {

/// A packet of occlusion rays with the light they carry, in the order in which they were added.
struct ShadowAnswers {
    int count;
    const uint32_t* target;
    const int* light;
    const RgbSoA& contribution;
    const float* tfar;
    bool isVisible(int i) const { return tfar[i] >= 0; }
};

/// Occlusion rays with the light they carry; `visible(answers)` is called for each packet.
template <class Visible>
class ShadowQueue {
  public:
    ShadowQueue(const Tracer& tracer, Visible visible) : m_tracer(tracer), m_visible(visible) {}
    void add(const Ray& ray, float tmax, uint32_t target, int light, const Rgb& contribution) {
        m_block.set(m_count, ray.o, ray.d, ray.tmin, tmax, ray.time);
        m_contribution.set(m_count, contribution);
        m_target[m_count] = target, m_light[m_count] = light, m_block.id[m_count] = 0;
        grow(1);
    }
    /// The useful ones of samples of a light; `id`: see RayPacket.
    void add(const VertexSoA& v, const VertexRows& at, const LightSoA& l, int light, uint32_t id) {
        int32_t order[kSoAWidth];
        int count = 0;
        for (int i = 0; i < l.count; ++i) {
            order[count] = i;
            count += l.useful[i] != 0;
        }
        for (int first = 0; first < count;) {
            const int n = std::min(count - first, RayPacket::kSize - m_count);
            append(v, at, l, light, id, order + first, n);
            first += n;
        }
    }
    void flush() {
        if (m_count == 0)
            return;
        m_tracer.occluded(m_block, m_count);
        m_traced += uint64_t(m_count);
        m_visible(ShadowAnswers{m_count, m_target, m_light, m_contribution, m_block.tfar});
        m_count = 0;
    }
    /// How many rays were traced since the last call.
    uint64_t takeCount() { return std::exchange(m_traced, 0); }

  private:
    void append(const VertexSoA& v, const VertexRows& at, const LightSoA& l, int light, uint32_t id,
                const int32_t* order, int n) {
        const bool isWholeRow = n == RayPacket::kSize && order[n - 1] - order[0] == n - 1;
        const auto copy = [&](const float* from, float* to) {
            if (isWholeRow)
                std::copy_n(from + order[0], RayPacket::kSize, to);
            else
                for (int k = 0; k < n; ++k)
                    to[m_count + k] = from[order[k]];
        };
        copy(at.p.x, m_block.ox), copy(at.p.y, m_block.oy), copy(at.p.z, m_block.oz);
        copy(l.light.wi.x, m_block.dx), copy(l.light.wi.y, m_block.dy), copy(l.light.wi.z, m_block.dz);
        copy(l.tmin, m_block.tnear), copy(l.tmax, m_block.tfar), copy(at.time, m_block.time);
        copy(l.contribution.r, m_contribution.r), copy(l.contribution.g, m_contribution.g);
        copy(l.contribution.b, m_contribution.b);
        for (int k = 0; k < n; ++k) {
            m_target[m_count + k] = v.path[l.vertex[order[k]]];
            m_light[m_count + k] = light, m_block.id[m_count + k] = id;
        }
        grow(n);
    }
    void grow(int n) {
        m_count += n;
        if (m_count == RayPacket::kSize)
            flush();
    }

    const Tracer& m_tracer;
    uint64_t m_traced = 0;
    Visible m_visible;
    int m_count = 0;
    uint32_t m_target[RayPacket::kSize];
    int m_light[RayPacket::kSize];
    RgbSoA m_contribution;
    RayPacket m_block;
};

/// Nearest-hit rays with a payload. `found(payload, hit)` is called in the order of `add`.
template <class Payload, class Found>
class HitQueue {
  public:
    HitQueue(const Tracer& tracer, Found found) : m_tracer(tracer), m_found(found) {}
    void add(const Ray& ray, const Payload& payload) {
        m_block.set(m_count, ray.o, ray.d, ray.tmin, kInfinity, ray.time);
        m_payload[m_count] = payload;
        if (++m_count == RayPacket::kSize)
            flush();
    }
    void flush() {
        if (m_count == 0)
            return;
        m_tracer.intersect(m_block, m_count, false);
        m_traced += uint64_t(m_count);
        for (int i = 0; i < m_count; ++i)
            m_found(m_payload[i], m_tracer.hit(m_block, i));
        m_count = 0;
    }
    /// How many rays were traced since the last call.
    uint64_t takeCount() { return std::exchange(m_traced, 0); }

  private:
    const Tracer& m_tracer;
    uint64_t m_traced = 0;
    Found m_found;
    int m_count = 0;
    Payload m_payload[RayPacket::kSize];
    RayPacket m_block;
};

} // namespace strobe
