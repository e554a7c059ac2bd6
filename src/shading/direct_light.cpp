#include "shading/direct_light.h"

#include "core/math/sampling.h"
#include "shading/emitted_light.h"

namespace strobe {

VertexSampleRanges::VertexSampleRanges(const PathBatch& batch, const VertexChunk& v,
                                       std::span<const int32_t> vertices, const VertexSamples& samples)
    : m_count(vertices.size()) {
    const uint32_t total = uint32_t(samples.total);
    for (size_t i = 0; i < m_count; ++i) {
        const Path& path = batch.paths[v.path[vertices[i]]];
        m_ranges[i] = {path.domain, path.index * total + uint32_t(samples.first), uint32_t(samples.count),
                       path.total * total};
    }
}

void AddVisibleLight::operator()(const ShadowPacket& packet) const {
    for (int i = 0; i < packet.count;) {
        // In the order of the rays, so that sums do not depend on how rays fill packets. The sum of a path
        // stays in registers.
        const uint32_t path = packet.path[i];
        Rgb& radiance = batch.paths[path].radiance;
        float r = radiance.x, g = radiance.y, b = radiance.z;
        for (; i < packet.count && packet.path[i] == path; ++i) {
            const bool visible = packet.isVisible(i);
            r += visible ? packet.contribution.r[i] : 0;
            g += visible ? packet.contribution.g[i] : 0;
            b += visible ? packet.contribution.b[i] : 0;
        }
        radiance.x = r;
        radiance.y = g;
        radiance.z = b;
    }
    if (!batch.components.isEnabled())
        return;
    for (int i = 0; i < packet.count; ++i)
        if (packet.isVisible(i))
            batch.components.add(packet.path[i], packet.light[i],
                                 batch.paths[packet.path[i]].sampledLightIsDirect, packet.contribution.at(i));
}

void AddLightRay::operator()(const LightRay& ray, const Hit& hit) const {
    if (!hit)
        return ray.light < 0 ? addBackground(ray) : void();
    const SurfacePoint s = context.scene.surface(hit, ray.time);
    ++batch.counters->surfaces;
    if (ray.light < 0 ? s.light < 0 : s.light != ray.light)
        return;
    const Rgb radiance = context.scene.emitted(s, hit, -ray.wi);
    const float weight =
        ray.light < 0
            ? treeLightRayWeight(context, batch.paths[ray.path], ray.bsdfPdf, s, ray.wi)
            : powerHeuristic(1, ray.bsdfPdf, 1, lightPdf(context.scene, s, ray.p, ray.time, ray.wi));
    batch.addLightRay(ray.path, s.light, ray.weight * radiance * weight);
}

/// Adds the light of environments to a path whose light ray missed the scene.
void AddLightRay::addBackground(const LightRay& ray) const {
    for (const int index : context.scene.environments()) {
        const Light& light = *context.scene.lights()[size_t(index)];
        const Rgb radiance = light.environment(ray.wi);
        if (isBlack(radiance))
            continue;
        const LightPoint vertex = batch.paths[ray.path].previousVertex();
        const float pdf =
            context.lightTree->probability(vertex, index, 0) * light.pdf(ray.p, ray.time, ray.wi, nullptr);
        batch.addLightRay(ray.path, index, ray.weight * radiance * powerHeuristic(1, ray.bsdfPdf, 1, pdf));
    }
}

DirectLight::DirectLight(const PathContext& context, PathBatch& batch)
    : m_context(context), m_batch(batch), m_shadowRays(context.scene.tracer(), AddVisibleLight{batch}),
      m_lightRays(context.scene.tracer(), AddLightRay{context, batch}) {}

void DirectLight::sample(VertexChunk& v, int bounce) {
    const auto& lights = m_context.scene.lights();
    if (lights.empty())
        return;
    const PathSettings& settings = m_context.settings;
    int32_t all[kSoAWidth], one[kSoAWidth]; // vertices that sample all lights (or several), and one
    size_t allCount = 0, oneCount = 0;
    for (int i = 0; i < v.count; ++i) {
        Path& path = m_batch.paths[v.path[i]];
        if (!v.isSmooth[i] || (path.component == LightComponent::Indirect && bounce == 0))
            continue;
        const bool isFirst = path.stage == PathStage::Camera || settings.isDirectOnly(path.component);
        path.sampledAllLights = isFirst && settings.strategy == LightStrategy::All;
        const bool samplesSeveral = isFirst && settings.samplesSeveral();
        (samplesSeveral ? all[allCount++] : one[oneCount++]) = i;
    }
    if (settings.strategy == LightStrategy::Tree) {
        sampleTree(v, std::span(all).first(allCount), settings.treeSamples(true), bounce);
        sampleTree(v, std::span(one).first(oneCount), settings.treeSamples(false), bounce);
        return;
    }
    if (allCount > 0)
        for (size_t i = 0; i < lights.size(); ++i)
            sampleLight(v, std::span(all).first(allCount), int(i), settings.samplesOf(*lights[i]), 1, bounce);
    if (oneCount > 0)
        sampleOneLight(v, std::span(one).first(oneCount), bounce);
}

void DirectLight::finishWave() {
    m_shadowRays.flush();
    m_lightRays.flush();
    if (m_hasLightRays)
        m_batch.addLightRaySums();
    m_hasLightRays = false;
    m_batch.counters->shadowRays += m_shadowRays.takeRayCount();
    m_batch.counters->lightRays += m_lightRays.takeRayCount();
}

/// Samples one light per vertex, chosen by the strategy's distribution. Vertices with the same light are
/// sampled together.
void DirectLight::sampleOneLight(VertexChunk& v, std::span<const int32_t> vertices, int bounce) {
    const LightSampler& lightSampler = m_context.lightSampler;
    if (m_context.scene.lights().size() == 1)
        return sampleLight(v, vertices, 0, 1, 1, bounce);
    float u[kSoAWidth];
    int lights[kSoAWidth]; // of each vertex; -1: has been sampled
    m_context.sampler.fill1D(VertexSampleRanges(m_batch, v, vertices),
                             vertexDimension(bounce, kDimLightSelection), u);
    for (size_t i = 0; i < vertices.size(); ++i)
        lights[i] = lightSampler.pick(u[i]);
    int32_t group[kSoAWidth];
    for (size_t i = 0; i < vertices.size(); ++i) {
        const int light = lights[i];
        if (light < 0)
            continue;
        size_t groupSize = 0;
        for (size_t j = i; j < vertices.size(); ++j)
            if (lights[j] == light) {
                group[groupSize++] = vertices[j];
                lights[j] = -1;
            }
        sampleLight(v, std::span(group).first(groupSize), light, 1, lightSampler.probability(light), bounce);
    }
}

/// Estimates the direct light of one light with `samples` light samples per vertex. `probability` is the
/// probability of choosing the light.
void DirectLight::sampleLight(VertexChunk& v, std::span<const int32_t> vertices, int light, int samples,
                              float probability, int bounce) {
    LightEstimate e{*m_context.scene.lights()[size_t(light)], light, samples, probability,
                    lightDimension(bounce, light)};
    if (e.light.isDelta())
        e.samples = 1; // all samples of a delta light are equal
    e.usesMis = countBsdfSamples(v, vertices, e);
    forSampleGroups(vertices, e.samples, [&](std::span<const int32_t> group, const VertexSamples& s) {
        addShadowRays(v, group, s, e);
    });
    if (e.usesMis)
        addLightRays(v, vertices, e);
}

/// Fills m_bsdfSampleCount. Returns false when no vertex combines light samples with BSDF samples.
bool DirectLight::countBsdfSamples(const VertexChunk& v, std::span<const int32_t> vertices,
                                   const LightEstimate& e) {
    std::fill(m_bsdfSampleCount, m_bsdfSampleCount + v.count, 0.f);
    if (e.light.isDelta())
        return false;
    alignas(64) float solidAngle[kSoAWidth];
    e.light.solidAngleSoA(v.p, v.time, v.count, solidAngle);
    bool any = false;
    for (const int32_t i : vertices) {
        if (!usesMis(v.maxPdf[i], solidAngle[i]))
            continue;
        const bool hasLightRays = m_context.settings.isDirectOnly(m_batch.paths[v.path[i]].component);
        m_bsdfSampleCount[i] = hasLightRays ? e.expectedSamples() : 1.f;
        any = true;
    }
    return any;
}

/// Adds the shadow rays of at most kSoAWidth light samples.
void DirectLight::addShadowRays(VertexChunk& v, std::span<const int32_t> vertices,
                                const VertexSamples& samples, const LightEstimate& e) {
    LightSampleChunk& l = m_lightSamples;
    if (!e.light.isDelta())
        m_context.sampler.fill2D(VertexSampleRanges(m_batch, v, vertices, samples),
                                 e.dimension + kDimLightSample, l.u);
    l.count = repeatVertices(vertices, samples.count, l.vertex);
    m_batch.counters->lightSamples += uint64_t(l.count);
    for (int i = 0; i < l.count; ++i)
        l.bsdfSamples[i] = m_bsdfSampleCount[l.vertex[i]];
    const VertexSoA& origins = v.bySample(vertices, samples.count);
    e.light.sampleSoA({origins.p, origins.time, l.vertex, l.u, l.count}, l.light);
    if (!l.findContributing(origins))
        return;
    v.forMaterialRuns(l.vertex, l.count, [&](const Material& m, int begin, int end) {
        m.evalCosSoA({v.bsdf, l.vertex, origins.woLocal, begin, end, l.contributes}, l.wiLocal, l.f,
                     e.usesMis ? l.bsdfPdf : nullptr);
    });
    l.computeContributions(origins, e.expectedSamples(), e.usesMis);
    m_shadowRays.add(v, origins, l, e.index, e.light.cannotSelfOcclude() ? RayPacket::idOfLight(e.index) : 0);
}

/// Adds the light rays of the vertices that use MIS and end their paths.
void DirectLight::addLightRays(VertexChunk& v, std::span<const int32_t> vertices, const LightEstimate& e) {
    int32_t last[kSoAWidth];
    size_t count = 0;
    for (const int32_t i : vertices)
        if (m_bsdfSampleCount[i] > 0 && m_context.settings.isDirectOnly(m_batch.paths[v.path[i]].component))
            last[count++] = i;
    forSampleGroups(
        std::span(last).first(count), e.samples,
        [&](std::span<const int32_t> group, const VertexSamples& s) { addLightRayGroup(v, group, s, e); });
}

/// Adds at most kSoAWidth light rays. For an environment light, adds shadow rays instead: its radiance does
/// not depend on a hit.
void DirectLight::addLightRayGroup(VertexChunk& v, std::span<const int32_t> vertices,
                                   const VertexSamples& samples, const LightEstimate& e) {
    const VertexSoA& origins = v.bySample(vertices, samples.count);
    if (!sampleBsdfs(v, origins, vertices, samples, e))
        return;
    LightRayChunk& b = m_bsdfSamples;
    v.forMaterialRuns(b.vertex, b.count, [&](const Material& m, int begin, int end) {
        m.evalCosSoA({v.bsdf, b.vertex, origins.woLocal, begin, end, b.mayHitLight}, b.bsdf.wi, b.f,
                     b.bsdfPdf);
    });
    const bool isEnvironment = e.light.isEnvironment();
    if (isEnvironment)
        e.light.environmentSoA(b.wi, b.count, b.background, b.lightPdf);
    for (int i = 0; i < b.count; ++i) {
        if (!b.mayHitLight[i] || !(b.bsdfPdf[i] > 0))
            continue;
        const int vertex = b.vertex[i];
        const Ray ray = v.spawnRay(vertex, b.wi.at(i), b.cosWi[i]);
        const Rgb weight =
            origins.beta.at(i) * b.f.at(i) * (1 / (b.bsdfPdf[i] * float(e.samples) * e.probability));
        if (!isEnvironment) {
            m_hasLightRays = true;
            m_lightRays.add(ray, {v.path[vertex], e.index, b.bsdfPdf[i], ray.o, ray.d, ray.time, weight});
        } else if (const Rgb radiance = b.background.at(i); !isBlack(radiance)) {
            m_shadowRays.add(ray, kInfinity, v.path[vertex], e.index,
                             weight * radiance * powerHeuristic(1, b.bsdfPdf[i], 1, b.lightPdf[i]));
        }
    }
}

/// Samples the BSDFs into m_bsdfSamples. Returns false when no sample may hit the light.
bool DirectLight::sampleBsdfs(const VertexChunk& v, const VertexSoA& origins,
                              std::span<const int32_t> vertices, const VertexSamples& samples,
                              const LightEstimate& e) {
    LightRayChunk& b = m_bsdfSamples;
    drawBsdfs(v, origins, vertices, samples, e.dimension);
    bool any = false;
    for (int i = 0; i < b.count; ++i) {
        b.setMayHitLight(i, b.isValid(i, origins.cosWo[i]) && !b.bsdf.delta[i] &&
                                e.light.mayIntersect(origins.p.at(i), origins.time[i], b.wi.at(i)));
        any |= b.mayHitLight[i] != 0;
    }
    return any;
}

/// Samples the BSDFs into m_bsdfSamples, up to their directions. `dimension`: the light's first dimension.
void DirectLight::drawBsdfs(const VertexChunk& v, const VertexSoA& origins, std::span<const int32_t> vertices,
                            const VertexSamples& samples, uint32_t dimension) {
    LightRayChunk& b = m_bsdfSamples;
    b.count = repeatVertices(vertices, samples.count, b.vertex);
    const VertexSampleRanges ranges(m_batch, v, vertices, samples);
    m_context.sampler.fill2D(ranges, dimension + kDimLightRayDirection, b.u);
    m_context.sampler.fill1D(ranges, dimension + kDimLightRayLobe, b.uLobe);
    v.forMaterialRuns(b.vertex, b.count, [&](const Material& m, int begin, int end) {
        m.sampleDirectionSoA({v.bsdf, b.vertex, origins.woLocal, begin, end, nullptr}, b.uLobe, b.u, b.bsdf);
    });
    b.transformToWorld(origins);
}

} // namespace strobe
