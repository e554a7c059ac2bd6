// How long it takes to read a mesh's file and to have Embree build it, and what memory Embree takes: the
// floor under a renderer's way from the scene to its first pixel. See bench/README.md.
#include "bench/measure.h"
#include "shapes/ply.h"

#include <CLI/CLI.hpp>
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <fmt/format.h>

#include <atomic>
#include <cstdio>
#include <fstream>

namespace strobe::bench {
namespace {

/// What Embree holds, and the most it has held.
struct Memory {
    std::atomic<int64_t> now{0}, most{0};
    static bool monitor(void* self, ssize_t bytes, bool) {
        auto& m = *static_cast<Memory*>(self);
        const int64_t now = m.now += bytes;
        for (int64_t most = m.most; now > most && !m.most.compare_exchange_weak(most, now);) {
        }
        return true;
    }
};

double secondsToRead(const std::string& path) {
    const double start = wallSeconds();
    std::ifstream file(path, std::ios::binary);
    std::vector<char> buffer(1 << 22);
    while (file.read(buffer.data(), std::streamsize(buffer.size())) || file.gcount() > 0) {
    }
    return wallSeconds() - start;
}

double secondsToBuild(PlyMesh& mesh, Memory& memory) {
    mesh.positions.reserve(mesh.positions.size() + 2); // Embree reads sixteen bytes at every vertex
    const double start = wallSeconds();
    RTCDevice device = rtcNewDevice(nullptr);
    rtcSetDeviceMemoryMonitorFunction(device, Memory::monitor, &memory);
    RTCScene scene = rtcNewScene(device);
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.positions.data(), 0,
                               sizeof(V3f), mesh.positions.size());
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.indices.data(), 0,
                               3 * sizeof(uint32_t), mesh.indices.size() / 3);
    rtcCommitGeometry(g);
    rtcAttachGeometry(scene, g);
    rtcReleaseGeometry(g);
    rtcCommitScene(scene);
    const double seconds = wallSeconds() - start;
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
    return seconds;
}

} // namespace
} // namespace strobe::bench

int main(int argc, char** argv) {
    using namespace strobe::bench;
    std::string path;
    CLI::App app("strobe_first_pixel: seconds to read a PLY file and to build it in Embree; Embree's memory");
    app.add_option("ply", path, "the mesh")->required()->check(CLI::ExistingFile);
    CLI11_PARSE(app, argc, argv);
    try {
        const double read = secondsToRead(path);
        strobe::PlyMesh mesh = strobe::readPlyFile(path, {});
        Memory memory;
        const double build = secondsToBuild(mesh, memory);
        fmt::print("{{\"triangles\": {}, \"read\": {:.4f}, \"build\": {:.4f}, \"embreeBytes\": {}}}\n",
                   mesh.indices.size() / 3, read, build, memory.most.load());
    } catch (const std::exception& e) {
        std::fprintf(stderr, "error: %s\n", e.what());
        return 1;
    }
    return 0;
}
