#include "bench/recording.h"

#include "core/render/render.h"
#include "loader/parser/parser.h"

#include <cstdio>
#include <cstring>

namespace strobe::bench {

static_assert(offsetof(RayPacket, mask) == sizeof(Packet::rows));

Packet::Packet(const RayPacket& packet, int n) : count(n) { std::memcpy(rows, &packet, sizeof rows); }

void Packet::load(RayPacket& packet) const {
    float* out[] = {packet.ox, packet.oy, packet.oz,   packet.tnear, packet.dx,
                    packet.dy, packet.dz, packet.time, packet.tfar};
    for (size_t row = 0; row < std::size(rows); ++row)
        std::copy_n(rows[row], RayPacket::kSize, out[row]); // a single memcpy is a function call and slower
    std::fill(packet.geom, packet.geom + RayPacket::kSize, kNone);
    std::fill(packet.inst, packet.inst + RayPacket::kSize, kNone);
}

namespace {

constexpr int kWindowsPerSide = 4;

/// A shader that returns a constant radiance.
class ConstantShader : public Shader {
  public:
    std::unique_ptr<ShaderWorker> makeWorker(const Scene&, const Sampler&,
                                             const LightComponents&) const override {
        return std::make_unique<Worker>();
    }
    bool hasIndirectLight() const override { return false; }

  private:
    struct Worker : ShaderWorker {
        void shade(const ShadingRequests& requests, const ShadeOutput& out, Counters& counters) override {
            counters.shades += requests.size();
            if (!out.radiance.empty())
                std::fill_n(&out.radiance[0].x, 3 * out.radiance.size(), .5f);
        }
    };
};

std::set<std::string> integratorNames() {
    std::set<std::string> names;
    for (const auto& row : pluginTables().integrators)
        names.insert(row.name);
    return names;
}

/// Returns diagnostics that print warnings to stderr.
Diagnostics printedDiagnostics() {
    return Diagnostics([](const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); });
}

/// Returns the windows and the tile size for about `cameraRays` camera rays.
Subject subjectOf(const std::string& name, BuiltScene built, uint64_t cameraRays) {
    Subject subject{name, std::move(built), {}, 32};
    const PixelBounds& frame = subject.built.pixelBounds;
    const double pixels = double(cameraRays) / subject.built.sampler.samplesPerPixel;
    const int side = std::max(4, int(std::sqrt(pixels) / kWindowsPerSide));
    subject.tileSize = std::max(4, side / 4);
    if (side * kWindowsPerSide >= std::min(frame.width(), frame.height())) {
        subject.windows = {frame};
        return subject;
    }
    for (int j = 0; j < kWindowsPerSide; ++j)
        for (int i = 0; i < kWindowsPerSide; ++i) {
            const int x = frame.x0 + (2 * i + 1) * frame.width() / (2 * kWindowsPerSide) - side / 2;
            const int y = frame.y0 + (2 * j + 1) * frame.height() / (2 * kWindowsPerSide) - side / 2;
            subject.windows.push_back({x, y, x + side, y + side});
        }
    return subject;
}

/// Renders all windows. Returns the sum of the counters.
Counters renderWith(const Subject& subject, const Integrator& integrator, const Shader& shader, int threads) {
    const BuiltScene& built = subject.built;
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.threads = threads;
    settings.tileSize = subject.tileSize;
    Counters total;
    for (const PixelBounds& pixelBounds : subject.windows) {
        Film film(built.resolution.x, built.resolution.y, pixelBounds);
        total.add(
            render(*built.scene, integrator, shader, *built.sampler.sampler, *built.filter, settings, film)
                .total);
    }
    return total;
}

} // namespace

Subject loadScene(const std::filesystem::path& path, const BuildOptions& options, uint64_t cameraRays) {
    Diagnostics diagnostics = printedDiagnostics();
    return subjectOf(path.stem().string(),
                     buildScene(parseFiles({path}, integratorNames(), diagnostics), options, diagnostics),
                     cameraRays);
}

Subject loadText(const std::string& name, const std::string& text, const BuildOptions& options,
                 uint64_t cameraRays) {
    Diagnostics diagnostics = printedDiagnostics();
    return subjectOf(
        name,
        buildScene(parseText(text, name + ".scene", integratorNames(), diagnostics), options, diagnostics),
        cameraRays);
}

Recording record(const Subject& subject) {
    Recording recording;
    const Tracer& tracer = subject.built.scene->tracer();
    tracer.observe([&](const RayPacket& packet, int n, Tracer::Query query) {
        const bool shadow = query == Tracer::Query::Occluded, camera = query == Tracer::Query::Coherent;
        (shadow ? recording.shadow : camera ? recording.camera : recording.bounce).emplace_back(packet, n);
        (shadow ? recording.shadowRays : camera ? recording.cameraRays : recording.bounceRays) += uint64_t(n);
    });
    renderWindows(subject, 1);
    tracer.observe({});
    return recording;
}

Counters renderWindows(const Subject& subject, int threads) {
    return renderWith(subject, *subject.built.integrator, *subject.built.shader, threads);
}

Counters renderVisibility(const Subject& subject, int threads) {
    return renderWith(subject, *subject.built.integrator, ConstantShader(), threads);
}

int guarded(const std::function<int()>& body) {
    try {
        return body();
    } catch (const Error& e) {
        std::fprintf(stderr, "%s\n", formatDiagnostic(e.location, "error", e.what()).c_str());
    } catch (const std::exception& e) {
        std::fprintf(stderr, "error: %s\n", e.what());
    }
    return 1;
}

} // namespace strobe::bench
