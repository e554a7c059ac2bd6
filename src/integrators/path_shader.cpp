#include "integrators/path_shader.h"

#include "core/sampling.h"
#include "integrators/path_state.h"
#include "integrators/ray_queues.h"

namespace strobe {

namespace {

const ParamDef<int> kMaxDepth{"maxdepth", 5,
                              "surfaces along a path; direct lighting: mirror and glass bounces + 1"};
const ParamDef<std::string> kStrategy{
    "strategy", "all", "lights at the first surface: all (each with its nsamples) or one, picked by power",
    "lightsamplestrategy"};
const ParamDef<int> kLightSamples{"lightsamples", 0,
                                  "samples of each light at a surface; 0: each light's own nsamples"};

class PathWorker : public ShaderWorker {
  public:
    PathWorker(const Scene& scene, const Sampler& sampler, const ShadeSettings& settings)
        : m_scene(scene), m_sampler(sampler), m_settings(settings) {}

    void shade(std::span<const ShadingRequest> requests, std::span<Rgb> radiance,
               Counters& counters) override {
        m_counters = &counters;
        start(requests);
        while (!m_active.empty())
            wave();
        for (size_t i = 0; i < requests.size(); ++i)
            radiance[i] = m_paths[i].radiance;
    }

  private:
    void start(std::span<const ShadingRequest> requests) {
        m_paths.clear();
        m_paths.resize(requests.size());
        m_active.clear();
        for (uint32_t i = 0; i < requests.size(); ++i) {
            const ShadingRequest& r = requests[i];
            Path& path = m_paths[i];
            path.hit = r.hit, path.ray = r.ray, path.cone = r.cone;
            path.domain = r.domain, path.index = r.index, path.total = r.total;
            path.part = r.part;
            if (r.part != LightPart::Albedo)
                ++(!r.hit                        ? m_counters->escaped
                   : r.part == LightPart::Direct ? m_counters->directShades
                                                 : m_counters->shades);
            m_active.push_back(i);
        }
    }

    /// One vertex of every active path; then all their rays.
    void wave() {
        auto lightVisible = [this](uint32_t path, const Rgb& c) { m_paths[path].direct += c; };
        auto probeFound = [this](const LightProbe& probe, const Hit& hit) { finishProbe(probe, hit); };
        ShadowQueue shadows(m_scene.tracer(), m_counters->shadowRays, lightVisible);
        HitQueue<LightProbe, decltype(probeFound)> probes(m_scene.tracer(), m_counters->lightRays,
                                                          probeFound);

        m_next.clear();
        for (uint32_t i : m_active)
            if (visit(i, shadows, probes))
                m_next.push_back(i);
        shadows.flush();
        probes.flush();
        for (uint32_t i : m_active) {
            Path& path = m_paths[i];
            path.radiance += path.direct + path.viaBsdf;
            path.direct = path.viaBsdf = Rgb(0);
        }
        auto bounceFound = [this](uint32_t path, const Hit& hit) { m_paths[path].hit = hit; };
        HitQueue<uint32_t, decltype(bounceFound)> bounces(m_scene.tracer(), m_counters->bounceRays,
                                                          bounceFound);
        for (uint32_t i : m_next)
            bounces.add(m_paths[i].ray, i);
        bounces.flush();
        m_active.swap(m_next);
    }

    /// Adds the light of the vertex that the path has reached; true when the path goes on along path.ray.
    template <class Shadows, class Probes>
    bool visit(uint32_t index, Shadows& shadows, Probes& probes) {
        Path& path = m_paths[index];
        if (!path.hit) {
            addEnvironment(path);
            return false;
        }
        Vertex v;
        v.s = m_scene.surface(path.hit, path.ray.time);
        ++m_counters->surfaces;
        v.wo = -path.ray.d;
        if (path.part != LightPart::Albedo)
            addEmission(path, v);
        if (path.bounce >= m_settings.maxDepth)
            return false;
        const float width = path.cone.width + path.hit.t * path.cone.spread;
        prepare(path, v, width);
        if (path.part == LightPart::Albedo) {
            path.radiance = v.s.material->albedo(v.bsdf);
            return false;
        }
        if (path.part == LightPart::Indirect && path.bounce == 0 && v.s.material->isTextured())
            path.beta = inverseAlbedo(v.s.material->albedo(v.bsdf));
        if (v.s.material->isSmooth()) {
            if (path.part != LightPart::Indirect || path.bounce > 0)
                addDirect(index, v, shadows, probes);
            if (endsHere(path))
                return false;
        }
        return extend(path, v, width);
    }

    /// At a surface that is neither mirror nor glass: whether the path is to bring direct light only. Then it
    /// finds lights by BSDF samples of their own, not by its next ray.
    bool endsHere(const Path& path) const { return !m_settings.path || path.part == LightPart::Direct; }

    /// What is black gives nothing to carry elsewhere.
    static Rgb inverseAlbedo(const Rgb& a) {
        constexpr float kBlack = 1e-4f;
        return {a.x > kBlack ? 1 / a.x : 0, a.y > kBlack ? 1 / a.y : 0, a.z > kBlack ? 1 / a.z : 0};
    }

    void prepare(const Path& path, Vertex& v, float width) {
        TextureQuery q;
        q.uv = v.s.uv;
        q.p = v.s.p;
        if (v.s.material->needsFootprint()) {
            footprint(v.s, path.ray.d, width, q);
            ++m_counters->footprints;
        }
        v.bsdf.material = v.s.material;
        v.s.material->prepare(q, v.bsdf);
        v.frame = Frame::fromNormal(v.s.ns);
        v.woLocal = v.frame.toLocal(v.wo);
        v.side = dot(v.wo, v.s.ng);
        v.maxPdf = v.s.material->maxPdf(v.bsdf, v.woLocal);
    }

    /// False when light sampling alone serves this light at a vertex of this sharpness.
    bool usesBsdfSampling(const Light& light, const V3f& p, float time, float maxPdf) const {
        return !light.isDelta() && !(maxPdf * light.solidAngle(p, time) < kNegligibleBsdfShare);
    }

    /// The weight of light `light` found by the path's last BSDF sample.
    float foundWeight(const Path& path, int index, const LightHit* hit) const {
        if (path.part == LightPart::Indirect && path.bounce <= 1)
            return 0; // the first surface's own and its direct light
        if (path.countsAllLight)
            return 1;
        const Light& light = *m_scene.lights()[size_t(index)];
        if (!usesBsdfSampling(light, path.from, path.ray.time, path.maxPdf))
            return 0;
        const float n = path.fromAllLights ? float(m_settings.samplesOf(light))
                                           : m_scene.lightPicker().probability(index);
        return powerHeuristic(1, path.pdf, n, light.pdf(path.from, path.ray.time, path.ray.d, hit));
    }

    void addEnvironment(Path& path) const {
        for (int i : m_scene.environments()) {
            const Rgb radiance = m_scene.lights()[size_t(i)]->environment(path.ray.d);
            if (!isBlack(radiance))
                path.radiance += path.beta * radiance * foundWeight(path, i, nullptr);
        }
    }

    void addEmission(Path& path, const Vertex& v) const {
        if (v.s.light < 0)
            return;
        const Rgb radiance = m_scene.lights()[size_t(v.s.light)]->emitted(v.s.ng, v.wo);
        if (isBlack(radiance))
            return;
        const LightHit hit{v.s.p, v.s.ng, length(v.s.p - path.from), v.s.prim};
        path.radiance += path.beta * radiance * foundWeight(path, v.s.light, &hit);
    }

    template <class Shadows, class Probes>
    void addDirect(uint32_t index, const Vertex& v, Shadows& shadows, Probes& probes) {
        Path& path = m_paths[index];
        const auto& lights = m_scene.lights();
        if (lights.empty())
            return;
        path.fromAllLights = m_settings.allLights && (path.firstSmooth || endsHere(path));
        if (path.fromAllLights) {
            for (int i = 0; i < int(lights.size()); ++i)
                addLight(index, v, i, m_settings.samplesOf(*lights[size_t(i)]), 1, shadows, probes);
        } else {
            const float u = m_sampler.get1D(path.domain, path.index, path.total, dimension(path, kDimPick));
            const int i = m_scene.lightPicker().pick(u);
            addLight(index, v, i, 1, m_scene.lightPicker().probability(i), shadows, probes);
        }
    }

    /// Direct light of one light by n samples (and, in direct lighting, n BSDF samples), of probability
    /// `picked`.
    template <class Shadows, class Probes>
    void addLight(uint32_t index, const Vertex& v, int lightIndex, int n, float picked, Shadows& shadows,
                  Probes& probes) {
        Path& path = m_paths[index];
        const Light& light = *m_scene.lights()[size_t(lightIndex)];
        if (light.isDelta())
            n = 1; // every sample is the same
        const uint32_t dim = dimension(path, kDimLights + kDimensionsPerLight * uint32_t(lightIndex));
        const SampleRange range{path.domain, path.index * uint32_t(n), uint32_t(n), path.total * uint32_t(n)};
        const bool bsdfToo = usesBsdfSampling(light, v.s.p, path.ray.time, v.maxPdf);
        const float bsdfCount = !bsdfToo ? 0.f : endsHere(path) ? float(n) * picked : 1.f;

        m_u.resize(size_t(n));
        m_lightSamples.resize(size_t(n));
        m_sampler.fill2D(range, dim, m_u.data());
        light.sample(v.s.p, path.ray.time, m_u.data(), n, m_lightSamples.data());
        sendLightSamples(index, v, n, picked, light.isDelta(), bsdfCount, shadows);
        if (bsdfToo && endsHere(path))
            sendBsdfSamples(index, v, lightIndex, range, dim, picked, shadows, probes);
    }

    template <class Shadows>
    void sendLightSamples(uint32_t index, const Vertex& v, int n, float picked, bool delta, float bsdfCount,
                          Shadows& shadows) {
        Path& path = m_paths[index];
        m_wi.resize(size_t(n)), m_f.resize(size_t(n)), m_pdf.resize(size_t(n));
        int kept = 0;
        for (int i = 0; i < n; ++i) {
            const LightSample& s = m_lightSamples[size_t(i)];
            const bool reflects = dot(s.wi, v.s.ng) * v.side > 0;
            if (isBlack(s.radiance) || !(s.pdf > 0) || !(reflects || v.s.material->transmits()))
                continue;
            m_wi[size_t(kept)] = v.frame.toLocal(s.wi);
            if (kept != i)
                m_lightSamples[size_t(kept)] = s;
            ++kept;
        }
        if (kept == 0)
            return;
        const bool weighs = !delta && bsdfCount > 0;
        v.s.material->evalCos(v.bsdf, v.woLocal, m_wi.data(), kept, m_f.data(),
                              weighs ? m_pdf.data() : nullptr);
        for (int i = 0; i < kept; ++i) {
            const Rgb& f = m_f[size_t(i)];
            if (isBlack(f))
                continue;
            const LightSample& s = m_lightSamples[size_t(i)];
            const float weight =
                weighs ? powerHeuristic(float(n) * picked, s.pdf, bsdfCount, m_pdf[size_t(i)]) : 1;
            const Rgb contribution = path.beta * f * s.radiance * (weight / (s.pdf * float(n) * picked));
            // Stop short of the light's own surface.
            const float tmax = s.distance < kInfinity ? s.distance * 0.9999f : kInfinity;
            shadows.add(leave(v, s.wi, path.ray.time), tmax, index, contribution);
        }
    }

    template <class Shadows, class Probes>
    void sendBsdfSamples(uint32_t index, const Vertex& v, int lightIndex, const SampleRange& range,
                         uint32_t dim, float picked, Shadows& shadows, Probes& probes) {
        Path& path = m_paths[index];
        const Light& light = *m_scene.lights()[size_t(lightIndex)];
        const float n = float(range.n);
        m_uLobe.resize(range.n);
        m_sampler.fill2D(range, dim + 1, m_u.data());
        m_sampler.fill1D(range, dim + 2, m_uLobe.data());
        for (uint32_t i = 0; i < range.n; ++i) {
            BsdfSample b;
            if (!v.s.material->sample(v.bsdf, v.woLocal, m_uLobe[i], m_u[i], b) || b.delta || !(b.pdf > 0))
                continue;
            const V3f wi = v.frame.toWorld(b.wi);
            if ((dot(wi, v.s.ng) * v.side > 0) == b.transmits || !light.mayMeet(v.s.p, path.ray.time, wi))
                continue;
            const Rgb weight = path.beta * b.weight * (1 / (n * picked));
            if (!light.isEnvironment()) {
                probes.add(leave(v, wi, path.ray.time),
                           {index, lightIndex, b.pdf, v.s.p, wi, path.ray.time, weight});
                continue;
            }
            const Rgb radiance = light.environment(wi);
            const float lightPdf = light.pdf(v.s.p, path.ray.time, wi, nullptr);
            if (!isBlack(radiance))
                shadows.add(leave(v, wi, path.ray.time), kInfinity, index,
                            weight * radiance * powerHeuristic(1, b.pdf, 1, lightPdf));
        }
    }

    void finishProbe(const LightProbe& probe, const Hit& hit) {
        if (!hit)
            return;
        const SurfacePoint s = m_scene.surface(hit, probe.time);
        ++m_counters->surfaces;
        if (s.light != probe.light)
            return;
        const Light& light = *m_scene.lights()[size_t(s.light)];
        const LightHit lightHit{s.p, s.ng, length(s.p - probe.from), s.prim};
        const float lightPdf = light.pdf(probe.from, probe.time, probe.wi, &lightHit);
        const Rgb radiance = light.emitted(s.ng, -probe.wi);
        m_paths[probe.path].viaBsdf += probe.weight * radiance * powerHeuristic(1, probe.pdf, 1, lightPdf);
    }

    /// Draws the next direction; false when the path ends.
    bool extend(Path& path, const Vertex& v, float width) {
        // Direct lighting goes on through mirrors and glass only.
        if (!m_settings.path && path.bounce + 1 >= m_settings.maxDepth)
            return false;
        const float uc = m_sampler.get1D(path.domain, path.index, path.total, dimension(path, kDimLobe));
        const V2f u = m_sampler.get2D(path.domain, path.index, path.total, dimension(path, kDimDirection));
        BsdfSample b;
        if (!v.s.material->sample(v.bsdf, v.woLocal, uc, u, b))
            return false;
        const V3f wi = v.frame.toWorld(b.wi);
        if ((dot(wi, v.s.ng) * v.side > 0) == b.transmits)
            return false; // the shading normal sent it through the surface
        path.beta *= b.weight;
        if (isBlack(path.beta))
            return false;
        path.ray = leave(v, normalize(wi), path.ray.time);
        path.cone.width = width;
        path.countsAllLight = b.delta;
        path.firstSmooth &= b.delta;
        path.pdf = b.pdf;
        path.maxPdf = v.maxPdf;
        path.from = v.s.p;
        return survivesRoulette(path);
    }

    bool survivesRoulette(Path& path) {
        if (m_settings.path && path.bounce >= kRouletteFrom) {
            const float survive = std::min(maxComponent(path.beta), 0.95f);
            const float u =
                m_sampler.get1D(path.domain, path.index, path.total, dimension(path, kDimRoulette));
            if (u >= survive)
                return false;
            path.beta *= 1 / survive;
        }
        ++path.bounce;
        return true;
    }

    static Ray leave(const Vertex& v, const V3f& wi, float time) { return {v.s.p, wi, time, v.s.tmin(wi)}; }

    static uint32_t dimension(const Path& path, uint32_t offset) {
        return kFirstDimension + uint32_t(path.bounce) * kDimensionsPerVertex + offset;
    }

    const Scene& m_scene;
    const Sampler& m_sampler;
    const ShadeSettings m_settings;
    Counters* m_counters = nullptr;

    std::vector<Path> m_paths;
    std::vector<uint32_t> m_active, m_next;
    // Scratch of one vertex and light.
    std::vector<V2f> m_u;
    std::vector<float> m_uLobe, m_pdf;
    std::vector<LightSample> m_lightSamples;
    std::vector<V3f> m_wi;
    std::vector<Rgb> m_f;
};

class PathShader : public Shader {
  public:
    PathShader(const ParamSet& params, bool path) {
        const std::string strategy = params.get(kStrategy);
        const bool one =
            strategy == "one" || strategy == "power" || strategy == "uniform" || strategy == "bvh";
        if (!one && strategy != "all" && strategy != "weighted")
            throw Error(params.whereIs(kStrategy),
                        "\"strategy\" must be \"all\" or \"one\", not \"" + strategy + "\"");
        m_settings = {path, params.get(kMaxDepth), !one, params.get(kLightSamples)};
        for (const ParamDef<int>* def : {&kMaxDepth, &kLightSamples})
            if (params.get(*def) < 0)
                throw Error(params.whereIs(*def), std::string("\"") + def->name + "\" must not be negative");
    }
    std::unique_ptr<ShaderWorker> makeWorker(const Scene& scene, const Sampler& sampler) const override {
        return std::make_unique<PathWorker>(scene, sampler, m_settings);
    }
    bool hasIndirectLight() const override { return m_settings.path && m_settings.maxDepth > 1; }

  private:
    ShadeSettings m_settings;
};

ShaderPlugin plugin(const char* name, const char* doc, bool path) {
    return {name,
            doc,
            {kMaxDepth, kStrategy, kLightSamples},
            [path](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const PathShader>(params, path);
            }};
}

} // namespace

ShaderPlugin directLightingPlugin() {
    return plugin("directlighting", "direct light at the first surface, through mirrors and glass", false);
}

ShaderPlugin pathPlugin() {
    return plugin("path", "path tracing: direct light at up to maxdepth surfaces, Russian roulette", true);
}

} // namespace strobe
