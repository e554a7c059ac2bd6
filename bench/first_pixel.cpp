// Measures the seconds of reading a PLY file and of Embree's build, and Embree's memory: a lower bound of the
// time to the first pixel. See bench/README.md.
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

/// The memory of Embree in bytes, and its peak.
struct Memory {
    std::atomic<int64_t> current{0}, peak{0};
    /// Embree's callback for allocations (bytes > 0) and deallocations (bytes < 0).
    static bool monitor(void* self, ssize_t bytes, bool) {
        auto& memory = *static_cast<Memory*>(self);
        const int64_t current = memory.current += bytes;
        for (int64_t peak = memory.peak;
             current > peak && !memory.peak.compare_exchange_weak(peak, current);) {
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
    mesh.positions.reserve(mesh.positions.size() + 2); // Embree reads sixteen bytes at each vertex
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
    CLI::App app("strobe_first_pixel: measures the seconds of reading a PLY file and of Embree's build, and "
                 "Embree's memory");
    app.add_option("ply", path, "PLY file")->required()->check(CLI::ExistingFile);
    CLI11_PARSE(app, argc, argv);
    try {
        const double read = secondsToRead(path);
        strobe::PlyMesh mesh = strobe::readPlyFile(path, {});
        Memory memory;
        const double build = secondsToBuild(mesh, memory);
        fmt::print("{{\"triangles\": {}, \"read\": {:.4f}, \"build\": {:.4f}, \"embreeBytes\": {}}}\n",
                   mesh.indices.size() / 3, read, build, memory.peak.load());
    } catch (const std::exception& e) {
        std::fprintf(stderr, "error: %s\n", e.what());
        return 1;
    }
    return 0;
}
