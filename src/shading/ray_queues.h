// Queues that collect rays until they fill a packet.
#pragma once

#include "shading/sample_chunks.h"

#include <utility>

namespace strobe {

/// A traced packet of shadow rays with the contributions that they carry, in the order in which they were
/// added.
struct ShadowPacket {
    int count;
    const uint32_t* path;
    const int* light;
    const RgbSoA& contribution;
    const float* tfar;
    bool isVisible(int i) const { return tfar[i] >= 0; }
};

/// Shadow rays with the contributions that they carry. Calls `traced(ShadowPacket)` for each packet.
template <class Traced>
class ShadowRayQueue {
  public:
    ShadowRayQueue(const Tracer& tracer, Traced traced) : m_tracer(tracer), m_traced(traced) {}
    /// Adds a ray that carries the contribution of `light` to a path.
    void add(const Ray& ray, float tmax, uint32_t path, int light, const Rgb& contribution) {
        m_packet.set(m_count, ray.o, ray.d, ray.tmin, tmax, ray.time);
        m_packet.id[m_count] = 0;
        m_contribution.set(m_count, contribution);
        m_path[m_count] = path;
        m_light[m_count] = light;
        advance(1);
    }
    /// Adds the rays of those samples of `light` that contribute. `origins` are the samples' vertices; `id`:
    /// see RayPacket.
    void add(const VertexChunk& v, const VertexSoA& origins, const LightSampleChunk& samples, int light,
             uint32_t id) {
        addContributing(v, origins, samples, [=](int) { return RayTarget{light, id}; });
    }
    /// Adds the rays of those samples of LightSampleChunk::target that contribute.
    void add(const VertexChunk& v, const VertexSoA& origins, const LightSampleChunk& samples) {
        addContributing(v, origins, samples, [&](int i) { return samples.target[i]; });
    }
    /// Traces the remaining rays.
    void flush() {
        if (m_count == 0)
            return;
        m_tracer.occluded(m_packet, m_count);
        m_rayCount += uint64_t(m_count);
        m_traced(ShadowPacket{m_count, m_path, m_light, m_contribution, m_packet.tfar});
        m_count = 0;
    }
    /// Returns the number of rays traced since the last call.
    uint64_t takeRayCount() { return std::exchange(m_rayCount, 0); }

  private:
    template <class TargetOf>
    void addContributing(const VertexChunk& v, const VertexSoA& origins, const LightSampleChunk& samples,
                         const TargetOf& targetOf) {
        int32_t contributing[kSoAWidth];
        int count = 0;
        for (int i = 0; i < samples.count; ++i) {
            contributing[count] = i;
            count += samples.contributes[i] != 0;
        }
        for (int first = 0; first < count;) {
            const int n = std::min(count - first, RayPacket::kSize - m_count);
            append(v, origins, samples, targetOf, contributing + first, n);
            first += n;
        }
    }
    /// Adds the rays of n samples; the packet has room for them.
    template <class TargetOf>
    void append(const VertexChunk& v, const VertexSoA& origins, const LightSampleChunk& samples,
                const TargetOf& targetOf, const int32_t* indices, int n) {
        const bool isWholePacket = n == RayPacket::kSize && indices[n - 1] - indices[0] == n - 1;
        const auto copy = [&](const float* from, float* to) {
            if (isWholePacket)
                std::copy_n(from + indices[0], RayPacket::kSize, to);
            else
                for (int k = 0; k < n; ++k)
                    to[m_count + k] = from[indices[k]];
        };
        copy(origins.p.x, m_packet.ox);
        copy(origins.p.y, m_packet.oy);
        copy(origins.p.z, m_packet.oz);
        copy(samples.light.wi.x, m_packet.dx);
        copy(samples.light.wi.y, m_packet.dy);
        copy(samples.light.wi.z, m_packet.dz);
        copy(samples.tmin, m_packet.tnear);
        copy(samples.tmax, m_packet.tfar);
        copy(origins.time, m_packet.time);
        copy(samples.contribution.r, m_contribution.r);
        copy(samples.contribution.g, m_contribution.g);
        copy(samples.contribution.b, m_contribution.b);
        for (int k = 0; k < n; ++k) {
            m_path[m_count + k] = v.path[samples.vertex[indices[k]]];
            const RayTarget target = targetOf(indices[k]);
            m_light[m_count + k] = target.light;
            m_packet.id[m_count + k] = target.id;
        }
        advance(n);
    }
    void advance(int n) {
        m_count += n;
        if (m_count == RayPacket::kSize)
            flush();
    }

    const Tracer& m_tracer;
    uint64_t m_rayCount = 0;
    Traced m_traced;
    int m_count = 0;
    uint32_t m_path[RayPacket::kSize];
    int m_light[RayPacket::kSize];
    RgbSoA m_contribution;
    RayPacket m_packet;
};

/// Rays to be traced to their nearest hits, each with a payload. Calls `traced(payload, hit)` in the order of
/// `add`.
template <class Payload, class Traced>
class NearestHitQueue {
  public:
    NearestHitQueue(const Tracer& tracer, Traced traced) : m_tracer(tracer), m_traced(traced) {}
    void add(const Ray& ray, const Payload& payload) {
        m_packet.set(m_count, ray.o, ray.d, ray.tmin, kInfinity, ray.time);
        m_payload[m_count] = payload;
        if (++m_count == RayPacket::kSize)
            flush();
    }
    /// Traces the remaining rays.
    void flush() {
        if (m_count == 0)
            return;
        m_tracer.intersect(m_packet, m_count, false);
        m_rayCount += uint64_t(m_count);
        for (int i = 0; i < m_count; ++i)
            m_traced(m_payload[i], m_tracer.hit(m_packet, i));
        m_count = 0;
    }
    /// Returns the number of rays traced since the last call.
    uint64_t takeRayCount() { return std::exchange(m_rayCount, 0); }

  private:
    const Tracer& m_tracer;
    uint64_t m_rayCount = 0;
    Traced m_traced;
    int m_count = 0;
    Payload m_payload[RayPacket::kSize];
    RayPacket m_packet;
};

} // namespace strobe
