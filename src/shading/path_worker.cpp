#include "shading/path_worker.h"

#include "core/math/sampling.h"

namespace strobe {

PathWorker::PathWorker(const Scene& scene, const Sampler& sampler, const ShadeSettings& settings,
                       const LightComponents& lightComponents)
    : m_scene(scene), m_sampler(sampler), m_settings(settings), m_lightComponents(lightComponents),
      m_manyMaterials(scene.materials().size() > 1), m_shadows(scene.tracer(), LightVisible{this}),
      m_probes(scene.tracer(), ProbeFound{this}), m_bounces(scene.tracer(), BounceFound{this}) {}

void PathWorker::shade(const ShadingRequests& requests, std::span<Rgb> radiance, Counters& counters) {
    m_counters = &counters;
    start(requests);
    startComponents(requests.size());
    m_bounce = 0;
    if (m_settings.maxDepth > 0)
        addAlbedos();
    for (; !m_active.empty(); ++m_bounce)
        wave();
    for (size_t i = 0; i < requests.size(); ++i)
        radiance[i] = m_paths[i].radiance;
    takeComponents(requests.size(), radiance.subspan(requests.size()));
    counters.shadowRays += m_shadows.takeCount();
    counters.lightRays += m_probes.takeCount();
    counters.bounceRays += m_bounces.takeCount();
}

void PathWorker::start(const ShadingRequests& requests) {
    if (m_paths.size() < requests.size())
        m_paths.resize(requests.size()), m_bucket.resize(requests.size());
    m_active.resize(requests.size());
    m_albedos.clear();
    uint32_t next = 0, active = 0;
    for (size_t b = 0; b < requests.chunks(); ++b) {
        const RequestSoA& r = requests.chunk(b);
        for (int i = 0; i < requests.chunkSize(b); ++i, ++next) {
            m_paths[next].start(r, i);
            meet(next, r.hit.at(i));
            const bool escapes = r.hit.geometry[i] == kNone;
            if (r.component[i] == LightComponent::Albedo && !escapes) {
                m_albedos.push_back(next);
                continue;
            }
            m_active[active++] = next;
            if (r.component[i] != LightComponent::Albedo)
                ++(escapes                                    ? m_counters->missed
                   : r.component[i] == LightComponent::Direct ? m_counters->directShades
                                                              : m_counters->shades);
        }
    }
    m_active.resize(active);
}

/// One vertex of every active path; then all their rays.
void PathWorker::wave() {
    sortByMaterial(m_active);
    m_next.clear();
    for (size_t first = 0; first < m_active.size(); first += kSoAWidth) {
        load(std::span(m_active).subspan(first, std::min<size_t>(kSoAWidth, m_active.size() - first)));
        if (m_v.count == 0)
            continue;
        m_v.finish();
        addDirect();
        extend();
    }
    m_shadows.flush();
    m_probes.flush();
    if (m_probed) {
        for (uint32_t i : m_active)
            m_paths[i].radiance += std::exchange(m_paths[i].viaBsdf, Rgb(0));
        joinComponents();
    }
    m_probed = false;
    m_bounces.flush();
    m_active.swap(m_next);
}

/// Notes what a path meets next.
void PathWorker::meet(uint32_t path, const Hit& hit) {
    m_paths[path].hit = hit;
    if (m_manyMaterials)
        m_bucket[path] = hit ? uint8_t(m_scene.geometry(hit).material % kBuckets) : 0;
}

/// Brings paths whose surfaces are of one material together, as far as it matters.
void PathWorker::sortByMaterial(std::vector<uint32_t>& paths) {
    if (!m_manyMaterials)
        return;
    uint32_t places[kBuckets + 1] = {};
    for (uint32_t i : paths)
        ++places[m_bucket[i] + 1];
    for (int b = 0; b < kBuckets; ++b)
        places[b + 1] += places[b];
    m_sorted.resize(paths.size());
    for (uint32_t i : paths)
        m_sorted[places[m_bucket[i]]++] = i;
    paths.swap(m_sorted);
}

/// False when light sampling alone serves this light at a vertex of this sharpness.
bool PathWorker::usesBsdfSampling(const Light& light, const V3f& p, float time, float maxPdf) const {
    return !light.isDelta() && bsdfSamplingCounts(maxPdf, light.solidAngle(p, time));
}

/// The weight of light `index` found by the path's last BSDF sample; lightPdf(): the light's density of it.
template <class LightPdf>
float PathWorker::foundWeight(const Path& path, int index, const LightPdf& lightPdf) const {
    if (path.component == LightComponent::Indirect && m_bounce <= 1)
        return 0; // the first surface's own and its direct light
    if (path.specularBounce)
        return 1;
    const Light& light = *m_scene.lights()[size_t(index)];
    if (!usesBsdfSampling(light, path.from, path.ray.time, path.maxPdf))
        return 0;
    const float n =
        path.fromAllLights ? float(m_settings.samplesOf(light)) : m_scene.lightSampler().probability(index);
    return powerHeuristic(1, path.pdf, n, lightPdf());
}

/// The light of all environments along the last rays of paths.
void PathWorker::addEnvironment(std::span<const uint32_t> paths) {
    if (paths.empty() || m_scene.environments().empty())
        return;
    V3SoA d;
    RgbSoA radiance;
    alignas(64) float pdf[kSoAWidth];
    bool weighs = false;
    for (size_t k = 0; k < paths.size(); ++k) {
        const Path& path = m_paths[paths[k]];
        d.set(int(k), path.ray.d);
        weighs |= !path.specularBounce;
    }
    for (int i : m_scene.environments()) {
        m_scene.lights()[size_t(i)]->environmentSoA(d, int(paths.size()), radiance, weighs ? pdf : nullptr);
        for (size_t k = 0; k < paths.size(); ++k) {
            Path& path = m_paths[paths[k]];
            const Rgb arriving = radiance.at(int(k));
            if (isBlack(arriving))
                continue;
            const Rgb c = path.beta * arriving * foundWeight(path, i, [&] { return pdf[k]; });
            path.radiance += c;
            if (!m_components.empty())
                addComponent(m_components, paths[k], i, path.stage != PathStage::Indirect, c);
        }
    }
}

void PathWorker::addEmission(uint32_t index, RawSurfacePoint s) {
    Path& path = m_paths[index];
    s.finish();
    const Rgb radiance = m_scene.lights()[size_t(s.light)]->emitted(s.ng, -path.ray.d, queryAt(s, path.hit));
    if (isBlack(radiance))
        return;
    const Rgb c =
        path.beta * radiance * foundWeight(path, s.light, [&] {
            const LightHit hit{s.p, s.ng, length(s.p - path.from), s.prim};
            return m_scene.lights()[size_t(s.light)]->pdf(path.from, path.ray.time, path.ray.d, &hit);
        });
    path.radiance += c;
    if (!m_components.empty())
        addComponent(m_components, index, s.light, path.stage != PathStage::Indirect, c);
}

std::span<const SampleRange> PathWorker::ranges(const int32_t* vertices, int count, int first, int drawn,
                                                int n) {
    for (int i = 0; i < count; ++i) {
        const Path& path = m_paths[m_v.path[vertices[i]]];
        m_ranges[size_t(i)] = {path.domain, path.index * uint32_t(n) + uint32_t(first), uint32_t(drawn),
                               path.total * uint32_t(n)};
    }
    return std::span(m_ranges).first(size_t(count));
}

/// The rows of vertices, each as often as it has samples.
const VertexRows& PathWorker::rowsOf(const int32_t* vertices, int count, int times) {
    if (times == 1 && count == m_v.count) // vertices ascend: these are all
        return m_v;
    m_rows.repeat(m_v, vertices, count, times);
    return m_rows;
}

/// The next ray of every path that goes on.
void PathWorker::extend() {
    int32_t vertices[kSoAWidth];
    int count = 0;
    // Direct lighting goes on through mirrors and glass only.
    if (m_settings.path || m_bounce + 1 < m_settings.maxDepth)
        for (int i = 0; i < m_v.count; ++i)
            if (!(m_v.isSmooth[i] && endsHere(m_paths[m_v.path[i]])))
                vertices[count++] = i;
    if (count == 0)
        return;
    drawDirections(vertices, count);
    const bool roulette = m_settings.path && m_bounce >= kRouletteFrom;
    if (roulette)
        m_sampler.fill1D(ranges(vertices, count), dimension(kDimRoulette), m_uRoulette);
    for (int i = 0; i < count; ++i) {
        const int v = vertices[i];
        if (!m_drawn.valid[i] || (m_cosine[i] * m_v.side[v] > 0) == m_drawn.transmits[i])
            continue; // absorbed, or the shading normal sent it through the surface
        Path& path = m_paths[m_v.path[v]];
        path.beta *= m_drawn.weight.at(i);
        if (isBlack(path.beta) || (roulette && !survivesRoulette(path, m_uRoulette[i])))
            continue;
        path.ray = {m_v.p.at(v), m_wi.at(i), m_v.time[v], tminFor(m_v.offset[v], m_cosine[i])};
        path.specularBounce = m_drawn.delta[i];
        path.stage = path.stage != PathStage::Camera ? PathStage::Indirect
                     : m_drawn.delta[i]              ? PathStage::Camera
                                                     : PathStage::FirstHit;
        path.pdf = m_drawn.pdf[i];
        path.maxPdf = m_v.maxPdf[v];
        path.from = m_v.p.at(v);
        m_next.push_back(m_v.path[v]);
        m_bounces.add(path.ray, m_v.path[v]);
    }
}

/// Fills m_drawn, m_wi (world) and m_cosine.
void PathWorker::drawDirections(const int32_t* vertices, int count) {
    bool lobes = false, directions = false;
    m_v.forMaterials(vertices, count, [&](const Material& m, int, int) {
        lobes |= m.flags().usesLobeSample, directions |= m.flags().usesDirectionSample;
    });
    if (lobes)
        m_sampler.fill1D(ranges(vertices, count), dimension(kDimLobe), m_uLobe);
    if (directions)
        m_sampler.fill2D(ranges(vertices, count), dimension(kDimDirection), m_u);
    const VertexRows& at = rowsOf(vertices, count, 1);
    m_v.forMaterials(vertices, count, [&](const Material& m, int begin, int end) {
        m.sampleSoA({m_v.bsdf, vertices, at.woLocal, begin, end, nullptr}, m_uLobe, m_u, m_drawn);
    });
    turnToWorld(at, count, m_drawn.wi, m_wi, m_cosine);
}

bool PathWorker::survivesRoulette(Path& path, float u) const {
    const float survive = std::min(maxComponent(path.beta), 0.95f);
    if (u >= survive)
        return false;
    path.beta *= 1 / survive;
    return true;
}

} // namespace strobe
