// Compares ways of tracing the rays of paths: singly, in packets, in sorted packets, and as streams. See
// bench/README.md.
#include "bench/embree_scene.h"
#include "bench/tracing.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <bit>
#include <numeric>

namespace strobe::bench {
namespace {

/// Packets that are sorted together and traced as one stream: about the rays of one batch of the renderer.
constexpr size_t kPacketsPerGroup = 512 / RayPacket::kSize;

/// The costs of each way of tracing, and its number of hits.
struct Comparison {
    Costs singly, packets, sorted, sorting, streams;
    uint64_t hits[4] = {}; ///< singly, packets, sorted, streams
};

/// Spreads ten bits to every third bit of 30.
uint32_t spreadBits(uint32_t x) {
    x = (x | x << 16) & 0x30000ff;
    x = (x | x << 8) & 0x300f00f;
    x = (x | x << 4) & 0x30c30c3;
    return (x | x << 2) & 0x9249249;
}

/// Returns a sort key by direction, then origin. Neighboring rays in this order are nearly parallel.
uint64_t sortKey(const Packet& packet, int lane, const Box3f& box) {
    const auto row = [&](int r) { return packet.rows[r][lane]; };
    const auto quantize = [](float x, float low, float high) {
        return spreadBits(uint32_t(std::clamp((x - low) / std::max(high - low, 1e-30f), 0.f, 1.f) * 1023));
    };
    uint64_t origin = 0;
    uint64_t direction = 0;
    for (int axis = 0; axis < 3; ++axis) {
        origin |= uint64_t(quantize(row(axis), box.min[axis], box.max[axis])) << axis;
        direction |= uint64_t(quantize(row(4 + axis), -1, 1)) << axis;
    }
    // The octant of the direction, 9 bits of the origin, then finer directions and origins.
    const uint64_t octant = direction >> 27;
    const uint64_t coarseOrigin = origin >> 21;
    return octant << 60 | coarseOrigin << 50 | (direction & 0x7ffffff) << 20 | (origin & 0xfffff);
}

/// Sorts the rays of each `groupSize` packets and returns new packets.
std::vector<Packet> sortedPackets(const std::vector<Packet>& packets, const Box3f& box, size_t groupSize) {
    std::vector<Packet> out;
    out.reserve(packets.size());
    std::vector<std::pair<uint64_t, uint32_t>> order;
    for (size_t first = 0; first < packets.size(); first += groupSize) {
        const size_t end = std::min(first + groupSize, packets.size());
        order.clear();
        for (size_t p = first; p < end; ++p)
            for (int i = 0; i < packets[p].count; ++i)
                order.emplace_back(sortKey(packets[p], i, box), uint32_t(p - first) * RayPacket::kSize + i);
        std::sort(order.begin(), order.end());
        for (size_t k = 0; k < order.size(); k += RayPacket::kSize) {
            out.push_back(packets[first]);
            out.back().count = int(std::min(order.size() - k, size_t(RayPacket::kSize)));
            for (int i = 0; i < RayPacket::kSize; ++i) {
                const uint32_t source = order[std::min(k + size_t(i), order.size() - 1)].second;
                for (int r = 0; r < 9; ++r)
                    out.back().rows[r][i] = packets[first + source / 16].rows[r][source % 16];
            }
        }
    }
    return out;
}

/// Returns the bounds of all ray origins.
Box3f boundsOfOrigins(const std::vector<Packet>& packets) {
    Box3f box;
    for (const Packet& p : packets)
        for (int i = 0; i < p.count; ++i)
            box.extendBy(V3f(p.rows[0][i], p.rows[1][i], p.rows[2][i]));
    return box;
}

/// Traces packets as streams of kPacketsPerGroup packets. Unused lanes become rays with tnear > tfar. Returns
/// the hits.
uint64_t traceStreams(const EmbreeScene& embree, const std::vector<Packet>& packets) {
    const ScopedFlushDenormals flushDenormals;
    std::vector<RayPacket> rayPackets(kPacketsPerGroup);
    uint64_t hits = 0;
    for (size_t first = 0; first < packets.size(); first += kPacketsPerGroup) {
        const size_t n = std::min(kPacketsPerGroup, packets.size() - first);
        for (size_t k = 0; k < n; ++k) {
            packets[first + k].load(rayPackets[k]);
            for (int i = packets[first + k].count; i < RayPacket::kSize; ++i) {
                rayPackets[k].tnear[i] = 1;
                rayPackets[k].tfar[i] = 0;
            }
        }
        embree.intersectStream(std::span(rayPackets.data(), n));
        for (size_t k = 0; k < n; ++k)
            hits += countHits(rayPackets[k], packets[first + k].count);
    }
    return hits;
}

/// Traces the packets once in each way and adds the costs.
void measureOnce(const EmbreeScene& embree, const std::vector<Packet>& packets, Comparison& comparison) {
    const auto trace = [&](const std::vector<Packet>& rays, uint64_t& hits, Costs& costs, const auto& work) {
        costs.add(measure([&] {
            hits = traceAll(rays, 1, [&](RayPacket& rays, int n) {
                work(rays, n);
                return countHits(rays, n);
            });
        }));
    };
    const auto packet = [&](RayPacket& rays, int n) { embree.intersect(rays, n, false); };
    trace(packets, comparison.hits[0], comparison.singly,
          [&](RayPacket& rays, int n) { embree.intersectSingly(rays, n); });
    trace(packets, comparison.hits[1], comparison.packets, packet);
    std::vector<Packet> sorted;
    const Box3f box = boundsOfOrigins(packets);
    comparison.sorting.add(measure([&] { sorted = sortedPackets(packets, box, kPacketsPerGroup); }));
    trace(sorted, comparison.hits[2], comparison.sorted, packet);
    comparison.streams.add(measure([&] { comparison.hits[3] = traceStreams(embree, packets); }));
}

int run(const std::vector<std::filesystem::path>& scenes, const BuildOptions& options, uint64_t cameraRays,
        int repeats) {
    fmt::print("| scene | rays | rays per packet | singly | packets | sorted packets | sorting | streams |\n"
               "|---|---|---|---|---|---|---|---|\n");
    bool agree = true;
    for (const auto& path : scenes) {
        const Subject subject = loadScene(path, options, cameraRays);
        const Recording recording = record(subject);
        const EmbreeScene embree(*subject.built.scene, {});
        Comparison warmUp, comparison;
        measureOnce(embree, recording.bounce, warmUp);
        for (int i = 0; i < repeats; ++i)
            measureOnce(embree, recording.bounce, comparison);
        const double rays = double(recording.bounceRays);
        const auto ns = [&](const Costs& costs) { return costs.medianCpu() / rays * 1e9; };
        fmt::print("| {} | {} | {:.1f} | {:.0f} | {:.0f} | {:.0f} | {:.0f} | {:.0f} |\n", subject.name,
                   recording.bounceRays, rays / double(recording.bounce.size()), ns(comparison.singly),
                   ns(comparison.packets), ns(comparison.sorted), ns(comparison.sorting),
                   ns(comparison.streams));
        for (uint64_t hits : comparison.hits)
            agree &= std::abs(double(hits) - double(comparison.hits[1])) <= 1e-4 * rays;
    }
    fmt::print("\nCPU nanoseconds per ray, medians of {} repeats. Packets: as the renderer traces them. "
               "Sorted packets "
               "and streams: groups of {} packets.\n",
               repeats, kPacketsPerGroup);
    if (!agree)
        fmt::print(stderr, "error: the numbers of hits differ\n");
    return agree ? 0 : 1;
}

} // namespace
} // namespace strobe::bench

int main(int argc, char** argv) {
    std::vector<std::filesystem::path> scenes;
    strobe::BuildOptions options;
    options.defines = {"maxdepth=5"};
    options.shading = "path";
    uint64_t cameraRays = 200000;
    int repeats = 5;
    CLI::App app("strobe_bounce: measures the CPU time of the rays of paths, traced singly, in packets and "
                 "as streams");
    app.add_option("scene", scenes, "scene files")->required()->check(CLI::ExistingFile);
    app.add_option("--rays", cameraRays, "approximate number of camera rays, spread over the frame");
    app.add_option("--repeats", repeats, "repeats; the medians are printed")->check(CLI::PositiveNumber);
    CLI11_PARSE(app, argc, argv);
    return strobe::bench::guarded([&] { return strobe::bench::run(scenes, options, cameraRays, repeats); });
}
