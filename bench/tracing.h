// Traces recorded rays with any function that traces a packet.
#pragma once

#include "bench/measure.h"
#include "bench/recording.h"

#include <atomic>

namespace strobe::bench {

/// Returns the number of lanes 0 … n-1 with a hit, after a nearest-hit query.
inline uint64_t countHits(const RayPacket& packet, int n) {
    return uint64_t(std::count_if(packet.geom, packet.geom + n, [](uint32_t g) { return g != kNone; }));
}
/// Returns the number of occluded lanes 0 … n-1, after an occlusion query.
inline uint64_t countOccluded(const RayPacket& packet, int n) {
    return uint64_t(std::count_if(packet.tfar, packet.tfar + n, [](float t) { return t < 0; }));
}

/// Returns the sum of trace(packet, number of rays) over all packets.
template <class Trace>
uint64_t traceAll(const std::vector<Packet>& packets, int threads, const Trace& trace) {
    std::atomic<uint64_t> sum{0};
    forChunks(packets.size(), threads, [&](size_t begin, size_t end) {
        RayPacket packet{};
        for (int i = 0; i < RayPacket::kSize; ++i)
            packet.set(i, V3f(0), V3f(0, 0, 1), 0, 0, 0);
        uint64_t partialSum = 0;
        for (size_t i = begin; i < end; ++i) {
            packets[i].load(packet);
            partialSum += trace(packet, packets[i].count);
        }
        sum += partialSum;
    });
    return sum;
}

} // namespace strobe::bench
