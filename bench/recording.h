// Records the rays that the renderer traces for a scene, so that benchmarks can trace them again.
#pragma once

#include "loader/build/builder.h"

#include <filesystem>
#include <functional>

namespace strobe::bench {

/// Up to sixteen rays: the members of a RayPacket that Embree reads or changes.
struct alignas(64) Packet {
    float rows[9][RayPacket::kSize]; ///< ox, oy, oz, tnear, dx, dy, dz, time, tfar
    int count;

    /// Copies rays 0 … n-1 of a packet.
    Packet(const RayPacket& packet, int n);
    /// Writes the rays to `packet` and clears its hits.
    void load(RayPacket& packet) const;
};

/// The packets that the renderer traces, in its order. Bounce rays are nearest-hit queries that do not start
/// at the camera.
struct Recording {
    std::vector<Packet> camera, shadow, bounce;
    uint64_t cameraRays = 0, shadowRays = 0, bounceRays = 0;
};

/// A built scene and the windows of its frame that are measured, spread evenly over the frame.
struct Subject {
    std::string name;
    BuiltScene built;
    std::vector<PixelBounds> windows;
    int tileSize = 32;
};

/// Reads and builds a scene file. `cameraRays` is the approximate number of camera rays to measure; it
/// determines the windows together with the samples per pixel. Throws Error.
Subject loadScene(const std::filesystem::path& path, const BuildOptions& options, uint64_t cameraRays);
/// Parses and builds the text of a scene. Throws Error.
Subject loadText(const std::string& name, const std::string& text, const BuildOptions& options,
                 uint64_t cameraRays);

/// Renders the windows once on one thread and returns the traced rays.
Recording record(const Subject& subject);

/// Renders the windows with the integrator and the shader of the scene. Returns the counters.
Counters renderWindows(const Subject& subject, int threads);
/// Renders the windows with the integrator of the scene and a shader that returns a constant. Returns the
/// counters.
Counters renderVisibility(const Subject& subject, int threads);

/// Runs body and returns its exit code. Prints exceptions to stderr, with the location of an Error, and
/// returns 1.
int guarded(const std::function<int()>& body);

} // namespace strobe::bench
