// The direct light of a chunk of vertices: light samples, and BSDF samples that may find a light.
#include "integrators/path_worker.h"

#include "core/sampling.h"

#include <numeric>

namespace strobe {

void PathWorker::addDirect() {
    const auto& lights = m_scene.lights();
    if (lights.empty())
        return;
    int32_t all[kLanes], one[kLanes];
    int allCount = 0, oneCount = 0;
    for (int i = 0; i < m_v.count; ++i) {
        Path& path = m_paths[m_v.path[i]];
        if (!m_v.material[i]->isSmooth() || (path.part == LightPart::Indirect && m_bounce == 0))
            continue;
        path.fromAllLights = m_settings.allLights && (path.firstSmooth || endsHere(path));
        (path.fromAllLights ? all[allCount++] : one[oneCount++]) = i;
    }
    if (allCount > 0)
        for (int i = 0; i < int(lights.size()); ++i)
            addLight(all, allCount, i, m_settings.samplesOf(*lights[size_t(i)]), 1);
    if (oneCount > 0)
        addPicked(one, oneCount);
}

/// Direct light of one light each, picked by power.
void PathWorker::addPicked(const int32_t* vertices, int count) {
    const LightPicker& picker = m_scene.lightPicker();
    if (m_scene.lights().size() == 1)
        return addLight(vertices, count, 0, 1, 1);
    float u[kLanes];
    int light[kLanes];
    m_sampler.fill1D(ranges(vertices, count), dimension(kDimPick), u);
    for (int i = 0; i < count; ++i)
        light[i] = picker.pick(u[i]);
    // Those that picked the same light, together.
    int32_t same[kLanes];
    for (int i = 0; i < count; ++i) {
        const int wanted = light[i];
        if (wanted < 0)
            continue;
        int sameCount = 0;
        for (int j = i; j < count; ++j)
            if (light[j] == wanted) {
                same[sameCount++] = vertices[j];
                light[j] = -1;
            }
        addLight(same, sameCount, wanted, 1, picker.probability(wanted));
    }
}

/// Direct light of one light by n samples at each vertex (and, in direct lighting, n BSDF samples); `picked`
/// is the probability of taking the light at all.
void PathWorker::addLight(const int32_t* vertices, int count, int lightIndex, int n, float picked) {
    const Light& light = *m_scene.lights()[size_t(lightIndex)];
    if (light.isDelta())
        n = 1; // every sample is the same
    const bool weighs = findBsdfShares(vertices, count, light, float(n) * picked);
    const int together = std::max(1, kLanes / n);
    for (int i = 0; i < count; i += together)
        for (int first = 0; first < n; first += kLanes)
            sendLightSamples(vertices + i, std::min(together, count - i), lightIndex, first,
                             std::min(n - first, kLanes), n, picked, weighs);
    for (int i = 0; i < count; ++i)
        if (m_bsdfShare[vertices[i]] > 0 && endsHere(m_paths[m_v.path[vertices[i]]]))
            sendBsdfSamples(vertices[i], lightIndex, n, picked);
}

/// How many samples of the BSDF compete with those of the light, at each of the vertices; false: none.
bool PathWorker::findBsdfShares(const int32_t* vertices, int count, const Light& light, float n) {
    std::fill(m_bsdfShare, m_bsdfShare + m_v.count, 0.f);
    if (light.isDelta())
        return false;
    bool any = false;
    alignas(64) float solidAngle[kLanes];
    light.solidAngleLanes(m_v.p, m_v.time, m_v.count, solidAngle);
    for (int i = 0; i < count; ++i) {
        const int v = vertices[i];
        if (!bsdfSamplingCounts(m_v.maxPdf[v], solidAngle[v]))
            continue;
        m_bsdfShare[v] = endsHere(m_paths[m_v.path[v]]) ? n : 1.f;
        any = true;
    }
    return any;
}

/// Samples `first` to `first + drawn` of n at each vertex: kLanes in all at most.
void PathWorker::sendLightSamples(const int32_t* vertices, int count, int lightIndex, int first, int drawn,
                                  int n, float picked, bool weighs) {
    LightLanes& l = m_light;
    m_sampler.fill2D(ranges(vertices, count, first, drawn, n),
                     dimension(kDimLights + kDimensionsPerLight * uint32_t(lightIndex)), m_u);
    l.count = 0;
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < drawn; ++k) {
            l.bsdfShare[l.count] = m_bsdfShare[vertices[i]];
            l.vertex[l.count++] = vertices[i];
        }
    const VertexRows& at = rowsOf(vertices, count, drawn);
    m_scene.lights()[size_t(lightIndex)]->sampleLanes({at.p, at.time, l.vertex, m_u, l.count}, l.light);
    if (!l.findUseful(at))
        return;
    m_v.forMaterials(l.vertex, l.count, [&](const Material& m, int begin, int end) {
        m.evalCosLanes({m_v.bsdf, l.vertex, at.woLocal, begin, end, l.useful}, l.local, l.f,
                       weighs ? l.pdf : nullptr);
    });
    l.weigh(at, float(n) * picked, weighs);
    m_shadows.add(m_v, at, l);
}

void PathWorker::sendBsdfSamples(int v, int lightIndex, int n, float picked) {
    const Light& light = *m_scene.lights()[size_t(lightIndex)];
    const Material& material = *m_v.material[v];
    const uint32_t pathIndex = m_v.path[v];
    const Path& path = m_paths[pathIndex];
    const uint32_t dim = dimension(kDimLights + kDimensionsPerLight * uint32_t(lightIndex));
    const SampleRange range{path.domain, path.index * uint32_t(n), uint32_t(n), path.total * uint32_t(n)};
    m_uBsdf.resize(range.n), m_uBsdfLobe.resize(range.n);
    m_sampler.fill2D(range, dim + 1, m_uBsdf.data());
    m_sampler.fill1D(range, dim + 2, m_uBsdfLobe.data());
    const V3f p = m_v.p.at(v), wo = m_v.woLocal.at(v);
    const Frame frame = m_v.frame(v);
    const float time = m_v.time[v];
    for (uint32_t i = 0; i < range.n; ++i) {
        BsdfSample b;
        if (!material.sample(m_v.bsdf[v], wo, m_uBsdfLobe[i], m_uBsdf[i], b) || b.delta || !(b.pdf > 0))
            continue;
        const V3f wi = frame.toWorld(b.wi);
        if ((dot(wi, m_v.ng.at(v)) * m_v.side[v] > 0) == b.transmits || !light.mayMeet(p, time, wi))
            continue;
        const Rgb weight = path.beta * b.weight * (1 / (float(n) * picked));
        if (!light.isEnvironment()) {
            m_probed = true;
            m_probes.add(m_v.leave(v, wi), {pathIndex, lightIndex, b.pdf, p, wi, time, weight});
            continue;
        }
        const Rgb radiance = light.environment(wi);
        const float lightPdf = light.pdf(p, time, wi, nullptr);
        if (!isBlack(radiance))
            m_shadows.add(m_v.leave(v, wi), kInfinity, pathIndex,
                          weight * radiance * powerHeuristic(1, b.pdf, 1, lightPdf));
    }
}

void PathWorker::finishProbe(const LightProbe& probe, const Hit& hit) {
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

} // namespace strobe
