// Recorded rays traced again, by anything that traces a packet.
#pragma once

#include "bench/measure.h"
#include "bench/recording.h"

#include <atomic>

namespace strobe::bench {

/// Lanes that hit something, after a nearest-hit trace.
inline uint64_t hitsOf(const RayPacket& packet, int n) {
    return uint64_t(std::count_if(packet.geom, packet.geom + n, [](uint32_t g) { return g != kNone; }));
}
/// Lanes that are blocked, after an occlusion trace.
inline uint64_t blockedOf(const RayPacket& packet, int n) {
    return uint64_t(std::count_if(packet.tfar, packet.tfar + n, [](float t) { return t < 0; }));
}

/// The sum of trace(packet, lanes) over all packets.
template <class Trace>
uint64_t traceAll(const std::vector<Packet>& packets, int threads, const Trace& trace) {
    std::atomic<uint64_t> sum{0};
    forChunks(packets.size(), threads, [&](size_t begin, size_t end) {
        RayPacket packet{};
        for (int i = 0; i < RayPacket::kSize; ++i)
            packet.set(i, V3f(0), V3f(0, 0, 1), 0, 0, 0);
        uint64_t found = 0;
        for (size_t i = begin; i < end; ++i) {
            packets[i].load(packet);
            found += trace(packet, packets[i].count);
        }
        sum += found;
    });
    return sum;
}

} // namespace strobe::bench
