// Recorded rays traced again, by anything that traces a block.
#pragma once

#include "bench/measure.h"
#include "bench/recording.h"

#include <atomic>

namespace strobe::bench {

/// Lanes that hit something, after a nearest-hit trace.
inline uint64_t hitsOf(const RayBlock& block, int n) {
    return uint64_t(std::count_if(block.geom, block.geom + n, [](uint32_t g) { return g != kNone; }));
}
/// Lanes that are blocked, after an occlusion trace.
inline uint64_t blockedOf(const RayBlock& block, int n) {
    return uint64_t(std::count_if(block.tfar, block.tfar + n, [](float t) { return t < 0; }));
}

/// The sum of trace(block, lanes) over all packets.
template <class Trace>
uint64_t traceAll(const std::vector<Packet>& packets, int threads, const Trace& trace) {
    std::atomic<uint64_t> sum{0};
    forChunks(packets.size(), threads, [&](size_t begin, size_t end) {
        RayBlock block{};
        for (int i = 0; i < RayBlock::kSize; ++i)
            block.set(i, V3f(0), V3f(0, 0, 1), 0, 0, 0);
        uint64_t found = 0;
        for (size_t i = begin; i < end; ++i) {
            packets[i].load(block);
            found += trace(block, packets[i].count);
        }
        sum += found;
    });
    return sum;
}

} // namespace strobe::bench
