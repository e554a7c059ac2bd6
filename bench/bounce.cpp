// Rays that leave surfaces, traced in several ways: which is fastest? See bench/README.md.
#include "bench/embree_scene.h"
#include "bench/tracing.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <bit>
#include <numeric>

namespace strobe::bench {
namespace {

/// Rays that are known at once: about as many as a batch of the renderer has.
constexpr size_t kTogether = 512 / RayPacket::kSize;

struct Ways {
    Costs singly, packets, sorted, sorting, streams;
    uint64_t found[4] = {};
};

/// Every third bit of 30, from ten.
uint32_t spread(uint32_t x) {
    x = (x | x << 16) & 0x30000ff;
    x = (x | x << 8) & 0x300f00f;
    x = (x | x << 4) & 0x30c30c3;
    return (x | x << 2) & 0x9249249;
}

/// Where a ray goes, then where it comes from: rays next to each other in this order go much the same way.
uint64_t orderOf(const Packet& packet, int lane, const Box3f& box) {
    const auto row = [&](int r) { return packet.rows[r][lane]; };
    const auto step = [](float x, float low, float high) {
        return spread(uint32_t(std::clamp((x - low) / std::max(high - low, 1e-30f), 0.f, 1.f) * 1023));
    };
    uint64_t origin = 0, direction = 0;
    for (int axis = 0; axis < 3; ++axis) {
        origin |= uint64_t(step(row(axis), box.min[axis], box.max[axis])) << axis;
        direction |= uint64_t(step(row(4 + axis), -1, 1)) << axis;
    }
    // The octant, then eight boxes, then finer directions.
    const uint64_t octant = direction >> 27, where = origin >> 21;
    return octant << 60 | where << 50 | (direction & 0x7ffffff) << 20 | (origin & 0xfffff);
}

/// The rays of each `together` packets, sorted and packed again.
std::vector<Packet> sortedPackets(const std::vector<Packet>& packets, const Box3f& box, size_t together) {
    std::vector<Packet> out;
    out.reserve(packets.size());
    std::vector<std::pair<uint64_t, uint32_t>> order;
    for (size_t first = 0; first < packets.size(); first += together) {
        const size_t end = std::min(first + together, packets.size());
        order.clear();
        for (size_t p = first; p < end; ++p)
            for (int i = 0; i < packets[p].count; ++i)
                order.emplace_back(orderOf(packets[p], i, box), uint32_t(p - first) * RayPacket::kSize + i);
        std::sort(order.begin(), order.end());
        for (size_t k = 0; k < order.size(); k += RayPacket::kSize) {
            out.push_back(packets[first]);
            out.back().count = int(std::min(order.size() - k, size_t(RayPacket::kSize)));
            for (int i = 0; i < RayPacket::kSize; ++i) {
                const uint32_t from = order[std::min(k + size_t(i), order.size() - 1)].second;
                for (int r = 0; r < 9; ++r)
                    out.back().rows[r][i] = packets[first + from / 16].rows[r][from % 16];
            }
        }
    }
    return out;
}

Box3f originsOf(const std::vector<Packet>& packets) {
    Box3f box;
    for (const Packet& p : packets)
        for (int i = 0; i < p.count; ++i)
            box.extendBy(V3f(p.rows[0][i], p.rows[1][i], p.rows[2][i]));
    return box;
}

/// Whole packets as streams of `kTogether`; lanes beyond a packet's count are rays that end where they begin.
uint64_t traceStreams(const EmbreeScene& embree, const std::vector<Packet>& packets) {
    const ScopedFlushDenormals fast;
    std::vector<RayPacket> rayPackets(kTogether);
    uint64_t found = 0;
    for (size_t first = 0; first < packets.size(); first += kTogether) {
        const size_t n = std::min(kTogether, packets.size() - first);
        for (size_t k = 0; k < n; ++k) {
            packets[first + k].load(rayPackets[k]);
            for (int i = packets[first + k].count; i < RayPacket::kSize; ++i)
                rayPackets[k].tnear[i] = 1, rayPackets[k].tfar[i] = 0;
        }
        embree.intersectStream(std::span(rayPackets.data(), n));
        for (size_t k = 0; k < n; ++k)
            found += hitsOf(rayPackets[k], packets[first + k].count);
    }
    return found;
}

void measureOnce(const EmbreeScene& embree, const std::vector<Packet>& packets, Ways& ways) {
    const auto trace = [&](const std::vector<Packet>& rays, uint64_t& found, Costs& costs, const auto& work) {
        costs.add(measure([&] {
            found = traceAll(rays, 1, [&](RayPacket& rays, int n) {
                work(rays, n);
                return hitsOf(rays, n);
            });
        }));
    };
    const auto packet = [&](RayPacket& rays, int n) { embree.intersect(rays, n, false); };
    trace(packets, ways.found[0], ways.singly,
          [&](RayPacket& rays, int n) { embree.intersectSingly(rays, n); });
    trace(packets, ways.found[1], ways.packets, packet);
    std::vector<Packet> sorted;
    const Box3f box = originsOf(packets);
    ways.sorting.add(measure([&] { sorted = sortedPackets(packets, box, kTogether); }));
    trace(sorted, ways.found[2], ways.sorted, packet);
    ways.streams.add(measure([&] { ways.found[3] = traceStreams(embree, packets); }));
}

int run(const std::vector<std::filesystem::path>& scenes, const BuildOptions& options, uint64_t cameraRays,
        int repeats) {
    fmt::print("| scene | rays | lanes filled | singly | packets | sorted packets | sorting | streams |\n"
               "|---|---|---|---|---|---|---|---|\n");
    bool ok = true;
    for (const auto& path : scenes) {
        const Subject subject = loadScene(path, options, cameraRays);
        const Recording recording = record(subject);
        const EmbreeScene embree(*subject.built.scene, {});
        Ways warmUp, ways;
        measureOnce(embree, recording.bounce, warmUp);
        for (int i = 0; i < repeats; ++i)
            measureOnce(embree, recording.bounce, ways);
        const double rays = double(recording.bounceRays);
        const auto ns = [&](const Costs& costs) { return costs.medianCpu() / rays * 1e9; };
        fmt::print("| {} | {} | {:.1f} | {:.0f} | {:.0f} | {:.0f} | {:.0f} | {:.0f} |\n", subject.name,
                   recording.bounceRays, rays / double(recording.bounce.size()), ns(ways.singly),
                   ns(ways.packets), ns(ways.sorted), ns(ways.sorting), ns(ways.streams));
        for (uint64_t found : ways.found)
            ok &= std::abs(double(found) - double(ways.found[1])) <= 1e-4 * rays;
    }
    fmt::print("\nCPU nanoseconds per ray, medians of {}. Packets as the renderer makes them; sorted, and "
               "streams, of {} packets together.\n",
               repeats, kTogether);
    if (!ok)
        fmt::print(stderr, "error: the ways do not agree on what is hit\n");
    return ok ? 0 : 1;
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
    CLI::App app("strobe_bounce: nanoseconds per ray that leaves a surface, traced in several ways");
    app.add_option("scene", scenes, "scene files")->required()->check(CLI::ExistingFile);
    app.add_option("--rays", cameraRays, "camera rays, about, spread over the frame");
    app.add_option("--repeats", repeats, "repeats, of which medians are shown")->check(CLI::PositiveNumber);
    CLI11_PARSE(app, argc, argv);
    return strobe::bench::guarded([&] { return strobe::bench::run(scenes, options, cameraRays, repeats); });
}
