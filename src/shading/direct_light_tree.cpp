// Direct light by the light tree.
#include "shading/direct_light.h"

namespace strobe {

/// Estimates the direct light of the vertices with `samples` emitters per vertex, chosen by the light tree.
void DirectLight::sampleTree(VertexChunk& v, std::span<const int32_t> vertices, int samples, int bounce) {
    int32_t last[kSoAWidth]; // vertices with light rays
    size_t lastCount = 0;
    for (const int32_t i : vertices) {
        Path& path = m_batch.paths[v.path[i]];
        m_bsdfSampleCount[i] = 1;
        if (!m_context.settings.isDirectOnly(path.component))
            continue;
        const bool mayHitLight =
            m_context.lightTree->maySubtend(v.p.at(i), v.time[i], kMinMisPdfRatio / v.maxPdf[i]);
        m_bsdfSampleCount[i] = mayHitLight ? float(samples) : 0.f;
        path.setPreviousVertex(v.lightPoint(i));
        path.maxBsdfPdf = v.maxPdf[i];
        if (mayHitLight)
            last[lastCount++] = i;
    }
    forSampleGroups(vertices, samples, [&](std::span<const int32_t> group, const VertexSamples& s) {
        addTreeShadowRays(v, group, s, bounce);
    });
    forSampleGroups(std::span(last).first(lastCount), samples,
                    [&](std::span<const int32_t> group, const VertexSamples& s) {
                        addTreeLightRays(v, group, s, bounce);
                    });
}

/// Adds the shadow rays of at most kSoAWidth light samples.
void DirectLight::addTreeShadowRays(VertexChunk& v, std::span<const int32_t> vertices,
                                    const VertexSamples& samples, int bounce) {
    LightSampleChunk& l = m_lightSamples;
    l.count = repeatVertices(vertices, samples.count, l.vertex);
    m_batch.counters->lightSamples += uint64_t(l.count);
    const VertexSampleRanges ranges(m_batch, v, vertices, samples);
    alignas(64) float u[kSoAWidth], uFine[kSoAWidth];
    m_context.sampler.fill1D(ranges, vertexDimension(bounce, kDimLightSelection), u);
    m_context.sampler.fill1D(ranges, vertexDimension(bounce, kDimLightSelectionFine), uFine);
    m_context.sampler.fill2D(ranges, vertexDimension(bounce, uint32_t(kDimTreeLight) + kDimLightSample), l.u);
    const VertexSoA& origins = v.bySample(vertices, samples.count);
    m_context.lightTree->pick({origins.p, origins.ng, origins.n, origins.cosWo, origins.transmissive,
                               origins.time, u, uFine, l.count, samples.count},
                              m_picks);
    const bool usesMis = sampleEmitters(v, origins);
    if (!l.findContributing(origins))
        return;
    v.forMaterialRuns(l.vertex, l.count, [&](const Material& m, int begin, int end) {
        m.evalCosSoA({v.bsdf, l.vertex, origins.woLocal, begin, end, l.contributes}, l.wiLocal, l.f,
                     usesMis ? l.bsdfPdf : nullptr);
    });
    l.computeContributions(origins, float(samples.total), usesMis);
    m_shadowRays.add(v, origins, l);
}

/// Samples the emitters of m_picks. Their densities include the probabilities of the choice. Returns true if
/// any sample is to be combined with BSDF samples.
bool DirectLight::sampleEmitters(const VertexChunk& v, const VertexSoA& origins) {
    LightSampleChunk& l = m_lightSamples;
    bool any = false;
    for (int i = 0; i < l.count; ++i) {
        const int index = m_picks.light[i];
        const Light& light = *m_context.scene.lights()[size_t(index)];
        const V3f p = origins.p.at(i);
        LightSample s = light.sampleEmitter(m_picks.emitter[i], p, origins.time[i], l.u.at(i));
        s.pdf *= m_picks.probability[i];
        l.light.set(i, s);
        const float bsdfSamples = m_bsdfSampleCount[l.vertex[i]];
        const bool isCombined = bsdfSamples > 0 && !light.isDelta() &&
                                usesMis(v.maxPdf[l.vertex[i]], light.solidAngle(p, origins.time[i]));
        l.bsdfSamples[i] = isCombined ? bsdfSamples : 0;
        any |= isCombined;
        l.target[i] = {index, light.cannotSelfOcclude() ? RayPacket::idOfLight(index) : 0};
    }
    return any;
}

/// Adds at most kSoAWidth light rays, which may hit any light.
void DirectLight::addTreeLightRays(VertexChunk& v, std::span<const int32_t> vertices,
                                   const VertexSamples& samples, int bounce) {
    const VertexSoA& origins = v.bySample(vertices, samples.count);
    LightRayChunk& b = m_bsdfSamples;
    drawBsdfs(v, origins, vertices, samples, vertexDimension(bounce, kDimTreeLight));
    for (int i = 0; i < b.count; ++i)
        b.setMayHitLight(i, b.isValid(i, origins.cosWo[i]) && !b.bsdf.delta[i]);
    v.forMaterialRuns(b.vertex, b.count, [&](const Material& m, int begin, int end) {
        m.evalCosSoA({v.bsdf, b.vertex, origins.woLocal, begin, end, b.mayHitLight}, b.bsdf.wi, b.f,
                     b.bsdfPdf);
    });
    for (int i = 0; i < b.count; ++i) {
        if (!b.mayHitLight[i] || !(b.bsdfPdf[i] > 0))
            continue;
        const int vertex = b.vertex[i];
        const Ray ray = v.spawnRay(vertex, b.wi.at(i), b.cosWi[i]);
        const Rgb weight = origins.beta.at(i) * b.f.at(i) * (1 / (b.bsdfPdf[i] * float(samples.total)));
        m_hasLightRays = true;
        m_lightRays.add(ray, {v.path[vertex], -1, b.bsdfPdf[i], ray.o, ray.d, ray.time, weight});
    }
}

} // namespace strobe
