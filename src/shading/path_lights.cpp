// The direct light of a chunk of vertices: light samples, and BSDF samples that may find a light.
#include "shading/path_worker.h"

#include "core/math/sampling.h"

#include <numeric>

namespace strobe {

void PathWorker::addDirect() {
    const auto& lights = m_scene.lights();
    if (lights.empty())
        return;
    int32_t all[kSoAWidth], one[kSoAWidth];
    int allCount = 0, oneCount = 0;
    for (int i = 0; i < m_v.count; ++i) {
        Path& path = m_paths[m_v.path[i]];
        if (!m_v.isSmooth[i] || (path.component == LightComponent::Indirect && m_bounce == 0))
            continue;
        path.fromAllLights = m_settings.allLights && (path.stage == PathStage::Camera || endsHere(path));
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
    const LightSampler& picker = m_scene.lightSampler();
    if (m_scene.lights().size() == 1)
        return addLight(vertices, count, 0, 1, 1);
    float u[kSoAWidth];
    int light[kSoAWidth];
    m_sampler.fill1D(ranges(vertices, count), dimension(kDimPick), u);
    for (int i = 0; i < count; ++i)
        light[i] = picker.pick(u[i]);
    // Those that picked the same light, together.
    int32_t same[kSoAWidth];
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
    const int together = std::max(1, kSoAWidth / n);
    for (int i = 0; i < count; i += together)
        for (int first = 0; first < n; first += kSoAWidth)
            sendLightSamples(vertices + i, std::min(together, count - i), lightIndex, first,
                             std::min(n - first, kSoAWidth), n, picked, weighs);
    if (weighs)
        addBsdfSamples(vertices, count, lightIndex, n, picked);
}

/// How many samples of the BSDF compete with those of the light, at each of the vertices; false: none.
bool PathWorker::findBsdfShares(const int32_t* vertices, int count, const Light& light, float n) {
    std::fill(m_bsdfShare, m_bsdfShare + m_v.count, 0.f);
    if (light.isDelta())
        return false;
    bool any = false;
    alignas(64) float solidAngle[kSoAWidth];
    light.solidAngleSoA(m_v.p, m_v.time, m_v.count, solidAngle);
    for (int i = 0; i < count; ++i) {
        const int v = vertices[i];
        if (!bsdfSamplingCounts(m_v.maxPdf[v], solidAngle[v]))
            continue;
        m_bsdfShare[v] = endsHere(m_paths[m_v.path[v]]) ? n : 1.f;
        any = true;
    }
    return any;
}

/// Samples `first` to `first + drawn` of n at each vertex: kSoAWidth in all at most.
void PathWorker::sendLightSamples(const int32_t* vertices, int count, int lightIndex, int first, int drawn,
                                  int n, float picked, bool weighs) {
    LightSoA& l = m_light;
    const Light& light = *m_scene.lights()[size_t(lightIndex)];
    if (!light.isDelta())
        m_sampler.fill2D(ranges(vertices, count, first, drawn, n), dimensionOf(lightIndex), m_u);
    l.count = 0;
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < drawn; ++k) {
            l.bsdfShare[l.count] = m_bsdfShare[vertices[i]];
            l.vertex[l.count++] = vertices[i];
        }
    const VertexRows& at = rowsOf(vertices, count, drawn);
    light.sampleSoA({at.p, at.time, l.vertex, m_u, l.count}, l.light);
    if (!l.findUseful(at))
        return;
    m_v.forMaterials(l.vertex, l.count, [&](const Material& m, int begin, int end) {
        m.evalCosSoA({m_v.bsdf, l.vertex, at.woLocal, begin, end, l.useful}, l.local, l.f,
                     weighs ? l.pdf : nullptr);
    });
    l.weigh(at, float(n) * picked, weighs);
    m_shadows.add(m_v, at, l, lightIndex, light.cannotSelfOcclude() ? RayPacket::idOfLight(lightIndex) : 0);
}

void PathWorker::addVisible(const ShadowAnswers& a) {
    for (int i = 0; i < a.count;) {
        // One after the other, so that no sum depends on how rays fill packets; but the path's stays in
        // registers.
        const uint32_t target = a.target[i];
        Rgb& radiance = m_paths[target].radiance;
        float r = radiance.x, g = radiance.y, b = radiance.z;
        for (; i < a.count && a.target[i] == target; ++i) {
            const bool visible = a.isVisible(i);
            r += visible ? a.contribution.r[i] : 0;
            g += visible ? a.contribution.g[i] : 0;
            b += visible ? a.contribution.b[i] : 0;
        }
        radiance.x = r, radiance.y = g, radiance.z = b;
    }
    if (m_components.empty())
        return;
    for (int i = 0; i < a.count; ++i)
        if (a.isVisible(i))
            addComponent(m_components, a.target[i], a.light[i], m_paths[a.target[i]].lightIsDirect,
                         a.contribution.at(i));
}

/// n samples of the BSDF for the light, at those of the vertices where they compete with the light's and the
/// path ends.
void PathWorker::addBsdfSamples(const int32_t* vertices, int count, int lightIndex, int n, float picked) {
    int32_t ending[kSoAWidth];
    int endingCount = 0;
    for (int i = 0; i < count; ++i)
        if (m_bsdfShare[vertices[i]] > 0 && endsHere(m_paths[m_v.path[vertices[i]]]))
            ending[endingCount++] = vertices[i];
    const int together = std::max(1, kSoAWidth / n);
    for (int i = 0; i < endingCount; i += together)
        for (int first = 0; first < n; first += kSoAWidth)
            sendBsdfSamples(ending + i, std::min(together, endingCount - i), lightIndex, first,
                            std::min(n - first, kSoAWidth), n, picked);
}

/// Draws directions from BSDFs into m_wi and tells in m_light.useful which may meet the light; false: none.
bool PathWorker::drawToLight(const VertexRows& at, const Light& light, uint32_t dim, const int32_t* vertices,
                             int count, int first, int drawn, int n) {
    LightSoA& l = m_light;
    m_sampler.fill2D(ranges(vertices, count, first, drawn, n), dim + 1, m_u);
    m_sampler.fill1D(ranges(vertices, count, first, drawn, n), dim + 2, m_uLobe);
    m_v.forMaterials(l.vertex, l.count, [&](const Material& m, int begin, int end) {
        m.sampleDirectionSoA({m_v.bsdf, l.vertex, at.woLocal, begin, end, nullptr}, m_uLobe, m_u, m_drawn);
    });
    turnToWorld(at, l.count, m_drawn.wi, m_wi, m_cosine);
    bool any = false;
    for (int i = 0; i < l.count; ++i) {
        l.useful[i] = m_drawn.valid[i] && !m_drawn.delta[i] &&
                      (m_cosine[i] * at.side[i] > 0) != m_drawn.transmits[i] &&
                      light.mayIntersect(at.p.at(i), at.time[i], m_wi.at(i));
        any |= l.useful[i] != 0;
        if (!l.useful[i]) // may be no direction at all
            m_wi.set(i, V3f(0, 0, 1)), m_drawn.wi.set(i, V3f(0, 0, 1));
    }
    return any;
}

/// Samples `first` to `first + drawn` of n at each vertex: kSoAWidth in all at most.
void PathWorker::sendBsdfSamples(const int32_t* vertices, int count, int lightIndex, int first, int drawn,
                                 int n, float picked) {
    LightSoA& l = m_light;
    const Light& light = *m_scene.lights()[size_t(lightIndex)];
    l.count = 0;
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < drawn; ++k)
            l.vertex[l.count++] = vertices[i];
    const VertexRows& at = rowsOf(vertices, count, drawn);
    const uint32_t dim = dimensionOf(lightIndex);
    if (!drawToLight(at, light, dim, vertices, count, first, drawn, n))
        return;
    m_v.forMaterials(l.vertex, l.count, [&](const Material& m, int begin, int end) {
        m.evalCosSoA({m_v.bsdf, l.vertex, at.woLocal, begin, end, l.useful}, m_drawn.wi, l.f, l.pdf);
    });
    const bool isEnvironment = light.isEnvironment();
    if (isEnvironment)
        light.environmentSoA(m_wi, l.count, l.light.radiance, l.light.pdf);
    for (int i = 0; i < l.count; ++i) {
        if (!l.useful[i] || !(l.pdf[i] > 0))
            continue;
        const int v = l.vertex[i];
        const V3f wi = m_wi.at(i);
        const Rgb weight = at.beta.at(i) * l.f.at(i) * (1 / (l.pdf[i] * float(n) * picked));
        if (!isEnvironment) {
            m_probed = true;
            m_probes.add(m_v.leave(v, wi),
                         {m_v.path[v], lightIndex, l.pdf[i], at.p.at(i), wi, at.time[i], weight});
        } else if (const Rgb radiance = l.light.radiance.at(i); !isBlack(radiance)) {
            m_shadows.add(m_v.leave(v, wi), kInfinity, m_v.path[v], lightIndex,
                          weight * radiance * powerHeuristic(1, l.pdf[i], 1, l.light.pdf[i]));
        }
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
    const Rgb radiance = light.emitted(s.ng, -probe.wi, queryAt(s, hit));
    const Rgb c = probe.weight * radiance * powerHeuristic(1, probe.pdf, 1, lightPdf);
    Path& path = m_paths[probe.path];
    path.viaBsdf += c;
    if (!m_components.empty())
        addComponent(m_componentsViaBsdf, probe.path, probe.light, path.lightIsDirect, c);
}

} // namespace strobe
