// The rays that the renderer traces for a scene, recorded once so that other code can trace them again.
#pragma once

#include "loader/build/builder.h"

#include <filesystem>
#include <functional>

namespace strobe::bench {

/// Up to sixteen rays: the part of a RayPacket that Embree reads and a trace changes.
struct alignas(64) Packet {
    float rows[9][RayPacket::kSize];
    int count;

    Packet(const RayPacket& packet, int n);
    /// Makes `packet` ready to be traced.
    void load(RayPacket& packet) const;
};

/// The packets that the renderer traces, in its order. Bounce rays are all those that look for the nearest
/// hit and do not come from the camera.
struct Recording {
    std::vector<Packet> camera, shadow, bounce;
    uint64_t cameraRays = 0, shadowRays = 0, bounceRays = 0;
};

/// A scene ready to render, and the part of its frame that is measured: windows spread evenly over it.
struct Subject {
    std::string name;
    BuiltScene built;
    std::vector<PixelBounds> windows;
    int tileSize = 32;
};

/// Reads and builds. `cameraRays`: how many to measure, about; the windows follow from it and from the
/// samples per pixel. Throws Error.
Subject loadScene(const std::filesystem::path& path, const BuildOptions& options, uint64_t cameraRays);
/// The same for a scene in memory.
Subject loadText(const std::string& name, const std::string& text, const BuildOptions& options,
                 uint64_t cameraRays);

/// Renders the windows once on one thread.
Recording record(const Subject& subject);

/// Renders the windows as the scene says, on `threads` threads.
Counters renderWindows(const Subject& subject, int threads);
/// The same with nothing to shade: every sample is worth the same.
Counters renderVisibility(const Subject& subject, int threads);

/// Runs a benchmark's main, printing a located Error as the renderer does.
int guarded(const std::function<int()>& body);

} // namespace strobe::bench
