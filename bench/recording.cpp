#include "bench/recording.h"

#include "core/render.h"
#include "scene/parser.h"

#include <cstdio>
#include <cstring>

namespace strobe::bench {

static_assert(offsetof(RayBlock, mask) == sizeof(Packet::rows));

Packet::Packet(const RayBlock& block, int n) : count(n) { std::memcpy(rows, &block, sizeof rows); }

void Packet::load(RayBlock& block) const {
    std::memcpy(static_cast<void*>(&block), rows, sizeof rows);
    std::fill(block.geom, block.geom + RayBlock::kSize, kNone);
    std::fill(block.inst, block.inst + RayBlock::kSize, kNone);
}

namespace {

// Of the path shader's first vertex. Recorded and rendered counts differ when these no longer agree.
constexpr uint32_t kFirstLightDimension = 16 + 8, kDimensionsPerLight = 4;
constexpr int kWindowsPerSide = 6;

/// Fills packets one ray at a time.
class Packer {
  public:
    Packer(std::vector<Packet>& packets, uint64_t& rays) : m_packets(packets), m_rays(rays) {}
    void add(const Ray& ray, float tmax) {
        m_block.set(m_count, ray.o, ray.d, ray.tmin, tmax, ray.time);
        ++m_rays;
        if (++m_count == RayBlock::kSize)
            flush();
    }
    void flush() {
        if (m_count > 0)
            m_packets.emplace_back(m_block, m_count);
        m_count = 0;
    }

  private:
    std::vector<Packet>& m_packets;
    uint64_t& m_rays;
    RayBlock m_block{};
    int m_count = 0;
};

/// An integrator that shades nothing: it writes down the rays of each batch.
class Recorder : public Integrator {
  public:
    Recorder(const Sampler& sampler, Recording& out) : m_sampler(sampler), m_out(out) {}
    std::unique_ptr<IntegratorRender> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<Recorded>(scene, m_sampler, m_out);
    }

  private:
    class Worker : public IntegratorWorker {
      public:
        Worker(const Scene& scene, const Sampler& sampler, Recording& out)
            : m_scene(scene), m_sampler(sampler), m_camera(out.camera, out.cameraRays),
              m_shadow(out.shadow, out.shadowRays) {}
        void plan(const VisibilityBatch& batch, std::vector<ShadingRequest>&) override {
            for (const VisibilitySample& sample : batch.samples)
                m_camera.add(sample.ray, kInfinity);
            m_camera.flush();
            for (const VisibilitySample& sample : batch.samples)
                if (sample.hit)
                    addShadowRays(batch, sample);
            m_shadow.flush();
        }
        void resolve(const VisibilityBatch&, std::span<const Rgb>, std::span<Rgb> values) override {
            std::fill(values.begin(), values.end(), Rgb(0));
        }

      private:
        void addShadowRays(const VisibilityBatch& batch, const VisibilitySample& sample) {
            const SurfacePoint s = m_scene.surface(sample.hit, sample.ray.time);
            if (!s.material->isSmooth())
                return;
            TextureQuery q;
            q.uv = s.uv;
            q.p = s.p;
            Bsdf bsdf;
            bsdf.material = s.material;
            s.material->prepare(q, bsdf);
            const uint64_t domain = batch.pixels[sample.pixel].domain;
            for (uint32_t i = 0; i < m_scene.lights().size(); ++i) {
                const Light& light = *m_scene.lights()[i];
                const uint32_t n = light.isDelta() ? 1 : uint32_t(light.sampleCount);
                const SampleRange range{domain, sample.index * n, n, batch.samplesPerPixel * n};
                m_u.resize(n), m_samples.resize(n);
                m_sampler.fill2D(range, kFirstLightDimension + kDimensionsPerLight * i, m_u.data());
                light.sample(s.p, sample.ray.time, m_u.data(), int(n), m_samples.data());
                for (const LightSample& l : m_samples)
                    addShadowRay(sample.ray, s, bsdf, l);
            }
        }
        void addShadowRay(const Ray& from, const SurfacePoint& s, const Bsdf& bsdf, const LightSample& l) {
            const bool reflects = dot(l.wi, s.ng) * dot(-from.d, s.ng) > 0;
            if (isBlack(l.radiance) || !(l.pdf > 0) || !(reflects || s.material->transmits()))
                return;
            const Frame frame = Frame::fromNormal(s.ns);
            const V3f wi = frame.toLocal(l.wi);
            Rgb f;
            float pdf;
            s.material->evalCos(bsdf, frame.toLocal(-from.d), &wi, 1, &f, &pdf);
            if (!isBlack(f))
                m_shadow.add({s.p, l.wi, from.time, s.tmin(l.wi)},
                             l.distance < kInfinity ? l.distance * 0.9999f : kInfinity);
        }

        const Scene& m_scene;
        const Sampler& m_sampler;
        Packer m_camera, m_shadow;
        std::vector<V2f> m_u;
        std::vector<LightSample> m_samples;
    };
    struct Recorded : IntegratorRender {
        Recorded(const Scene& s, const Sampler& sampler_, Recording& o)
            : scene(s), sampler(sampler_), out(o) {}
        std::unique_ptr<IntegratorWorker> makeWorker() override {
            return std::make_unique<Worker>(scene, sampler, out);
        }
        const Scene& scene;
        const Sampler& sampler;
        Recording& out;
    };

    const Sampler& m_sampler;
    Recording& m_out;
};

std::set<std::string> sharingNames() {
    std::set<std::string> names;
    for (const auto& row : pluginTables().integrators)
        names.insert(row.name);
    return names;
}

Messages warnings() {
    return Messages([](const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); });
}

Subject subjectOf(const std::string& name, BuiltScene built, uint64_t cameraRays) {
    Subject subject{name, std::move(built), {}, 32};
    const Window& frame = subject.built.window;
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

Counters renderWith(const Subject& subject, const Integrator& integrator, int threads) {
    const BuiltScene& built = subject.built;
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.threads = threads;
    settings.tileSize = subject.tileSize;
    Counters total;
    for (const Window& window : subject.windows) {
        Film film(built.resolution.x, built.resolution.y, window);
        total.add(render(*built.scene, integrator, *built.shader, *built.sampler.sampler, *built.filter,
                         settings, film)
                      .total);
    }
    return total;
}

} // namespace

Subject loadScene(const std::filesystem::path& path, const BuildOptions& options, uint64_t cameraRays) {
    Messages messages = warnings();
    return subjectOf(path.stem().string(),
                     buildScene(parseFiles({path}, sharingNames(), messages), options, messages), cameraRays);
}

Subject loadText(const std::string& name, const std::string& text, const BuildOptions& options,
                 uint64_t cameraRays) {
    Messages messages = warnings();
    return subjectOf(
        name, buildScene(parseText(text, name + ".scene", sharingNames(), messages), options, messages),
        cameraRays);
}

Recording record(const Subject& subject) {
    Recording recording;
    renderWith(subject, Recorder(*subject.built.sampler.sampler, recording), 1);
    return recording;
}

Counters renderWindows(const Subject& subject, int threads) {
    return renderWith(subject, *subject.built.integrator, threads);
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
