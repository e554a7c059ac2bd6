#include "shading/path_worker.h"

#include "shading/emitted_light.h"
#include "shading/path_vertices.h"

#include <algorithm>

namespace strobe {

namespace {

/// Calls work(chunk) for chunks of up to kSoAWidth paths.
template <class Work>
void forChunks(std::span<const uint32_t> paths, const Work& work) {
    for (size_t first = 0; first < paths.size(); first += kSoAWidth)
        work(paths.subspan(first, std::min<size_t>(kSoAWidth, paths.size() - first)));
}

/// Russian roulette (Arvo and Kirk, "Particle Transport and Image Synthesis", 1990). The probability of
/// survival is the throughput's largest component, at most 0.95; u is in [0,1). Returns false when the path
/// ends; otherwise, divides its throughput by the probability.
bool survivesRoulette(Path& path, float u) {
    const float probability = std::min(maxComponent(path.beta), 0.95f);
    if (u >= probability)
        return false;
    path.beta *= 1 / probability;
    return true;
}

/// Returns the stage of the ray that follows a BSDF sample.
PathStage nextStage(PathStage stage, bool isDelta) {
    if (stage != PathStage::Camera)
        return PathStage::Indirect;
    return isDelta ? PathStage::Camera : PathStage::FirstHit;
}

/// Sets the medium of a path that crosses the surface of vertex `i` to the side of `cosWi`.
void enterMedium(const Scene& scene, const VertexChunk& v, int i, float cosWi, Path& path) {
    const Geometry& geometry = scene.geometry(v.hits.at(i));
    path.absorption = cosWi < 0 ? geometry.absorptionInside : geometry.absorptionOutside;
    path.isAbsorbed = !isBlack(path.absorption);
}

/// Sets the ray of a path to BSDF sample k, and the inputs of its MIS weight.
void setNextRay(Path& path, const VertexChunk& v, const BsdfSampleChunk& b, int k) {
    const int vertex = b.vertex[k];
    path.ray = v.spawnRay(vertex, b.wi.at(k), b.cosWi[k]);
    path.specularBounce = b.bsdf.delta[k];
    path.stage = nextStage(path.stage, b.bsdf.delta[k]);
    path.recorded = nextStage(path.recorded, b.bsdf.delta[k] || v.isSharp[vertex]);
    path.bsdfPdf = b.bsdf.pdf[k];
    path.maxBsdfPdf = v.maxPdf[vertex];
    path.setPreviousVertex(v.lightPoint(vertex));
}

/// Resolves LightStrategy::Auto, and builds the light tree if it is needed: unless all lights are black.
PathContext makeContext(const Scene& scene, const Sampler& sampler, PathSettings settings) {
    settings.strategy = settings.strategyFor(scene);
    const LightTree* tree = nullptr;
    if (settings.strategy == LightStrategy::Tree) {
        tree = &scene.lightTree(settings.tree);
        if (tree->isEmpty()) {
            tree = nullptr;
            settings.strategy = LightStrategy::Power;
        }
    }
    const bool isUniform = settings.strategy == LightStrategy::Uniform;
    return {scene, sampler, settings, isUniform ? scene.uniformLightSampler() : scene.lightSampler(), tree};
}

} // namespace

PathWorker::PathWorker(const Scene& scene, const Sampler& sampler, const PathSettings& settings,
                       const LightComponents& lightComponents)
    : m_context(makeContext(scene, sampler, settings)), m_batch(scene, lightComponents),
      m_directLight(m_context, m_batch), m_nextRays(scene.tracer(), SetHit{m_batch}) {}

void PathWorker::shade(const ShadingRequests& requests, const ShadeOutput& out, Counters& counters) {
    m_batch.start(requests, counters);
    m_batch.firstVertices = out.firstVertices;
    std::fill(out.firstVertices.begin(), out.firstVertices.end(), FirstVertex{});
    if (m_context.settings.maxDepth > 0)
        shadeAlbedos();
    for (int bounce = 0; !m_batch.active.empty(); ++bounce)
        traceWave(bounce);
    m_batch.write(requests.size(), out.radiance);
    counters.bounceRays += m_nextRays.takeRayCount();
}

void PathWorker::shadeAlbedos() {
    m_batch.sortByMaterial(m_batch.albedo);
    forChunks(m_batch.albedo, [&](std::span<const uint32_t> paths) {
        VertexChunk& v = m_vertices;
        gatherHits(m_context.scene, m_batch, paths, v);
        evaluateSurfaces(m_context.scene, *m_batch.counters, v);
        prepareBsdfs(*m_batch.counters, v);
        for (int i = 0; i < v.count; ++i)
            m_batch.paths[v.path[i]].radiance = v.surface.material[i]->albedo(v.bsdf[i]);
    });
}

/// Moves the paths whose depth is reached to the end of the active paths. Returns the number of the others.
size_t PathWorker::continuingPaths(int bounce) {
    const PathSettings& settings = m_context.settings;
    std::vector<uint32_t>& active = m_batch.active;
    if (settings.transparentDepth == 0 || bounce < settings.maxDepth)
        return bounce < settings.maxDepth ? active.size() : 0;
    const auto end = std::stable_partition(active.begin(), active.end(), [&](uint32_t path) {
        return bounce - m_batch.paths[path].crossings < settings.maxDepth;
    });
    return size_t(end - active.begin());
}

/// Extends all active paths by one vertex: adds the light that their last rays hit and the direct light of
/// the vertex, and traces the next rays.
void PathWorker::traceWave(int bounce) {
    m_batch.sortByMaterial(m_batch.active);
    m_batch.next.clear();
    const size_t continuing = continuingPaths(bounce);
    const std::span<const uint32_t> active(m_batch.active);
    const auto addLight = [&](std::span<const uint32_t> paths) {
        gatherHits(m_context.scene, m_batch, paths, m_vertices);
        addBackground(m_context, m_batch, m_vertices, bounce);
        evaluateSurfaces(m_context.scene, *m_batch.counters, m_vertices);
        addEmission(m_context, m_batch, m_vertices, bounce);
        if (bounce == 0 && !m_batch.firstVertices.empty())
            recordEmission(m_batch, paths);
    };
    forChunks(active.first(continuing), [&](std::span<const uint32_t> paths) {
        addLight(paths);
        if (m_vertices.count == 0)
            return;
        prepareVertices(bounce);
        m_directLight.sample(m_vertices, bounce);
        spawnRays(bounce);
    });
    forChunks(active.subspan(continuing), addLight);
    m_directLight.finishWave();
    m_nextRays.flush();
    m_batch.active.swap(m_batch.next);
}

void PathWorker::prepareVertices(int bounce) {
    prepareBsdfs(*m_batch.counters, m_vertices);
    if (bounce == 0)
        divideByAlbedo(m_batch, m_vertices);
    adjustShadingNormals(m_context.scene, m_vertices);
    completeVertices(m_context.scene, m_vertices);
    if (!m_batch.firstVertices.empty())
        recordFirstVertices(m_batch, m_vertices);
}

/// Samples the BSDFs of the chunk's vertices and adds the paths' next rays to the queue.
void PathWorker::spawnRays(int bounce) {
    const VertexChunk& v = m_vertices;
    BsdfSampleChunk& b = m_bsdfSamples;
    const PathSettings& settings = m_context.settings;
    if (!settings.hasIndirectLight && bounce + 1 >= settings.maxDepth + settings.transparentDepth)
        return;
    b.count = 0;
    const auto componentAt = [&](int i) { return m_batch.paths[v.path[i]].component; };
    const auto endsAtSmoothLobes = [&](int i) {
        return v.isSmooth[i] && settings.isDirectOnly(componentAt(i));
    };
    for (int i = 0; i < v.count; ++i)
        if (!endsAtSmoothLobes(i) ||
            (v.surface.material[i]->flags().delta && settings.followsDelta(componentAt(i))))
            b.vertex[b.count++] = i;
    if (b.count == 0)
        return;
    const VertexSampleRanges ranges(m_batch, v, std::span(b.vertex).first(size_t(b.count)));
    sampleBsdfs(ranges, bounce);
    alignas(64) float uRoulette[kSoAWidth];
    const bool hasMedia = m_context.scene.hasMedia();
    const bool usesRoulette = settings.hasIndirectLight && bounce >= kFirstRouletteBounce;
    if (usesRoulette)
        m_context.sampler.fill1D(ranges, vertexDimension(bounce, kDimRoulette), uRoulette);
    for (int k = 0; k < b.count; ++k) {
        if (!b.isValid(k, v.cosWo[b.vertex[k]]) || (endsAtSmoothLobes(b.vertex[k]) && !b.bsdf.delta[k]))
            continue;
        const uint32_t index = v.path[b.vertex[k]];
        Path& path = m_batch.paths[index];
        path.beta *= b.bsdf.weight.at(k);
        if (isBlack(path.beta) || (usesRoulette && !survivesRoulette(path, uRoulette[k])))
            continue;
        if (b.bsdf.transmits[k] && path.crossings < settings.transparentDepth)
            ++path.crossings;
        if (!settings.hasIndirectLight && bounce + 1 - path.crossings >= settings.maxDepth)
            continue;
        setNextRay(path, v, b, k);
        if (hasMedia && b.bsdf.transmits[k])
            enterMedium(m_context.scene, v, b.vertex[k], b.cosWi[k], path);
        m_batch.next.push_back(index);
        m_nextRays.add(path.ray, index);
    }
}

/// Samples the BSDFs at the vertices of m_bsdfSamples.
void PathWorker::sampleBsdfs(const VertexSampleRanges& ranges, int bounce) {
    BsdfSampleChunk& b = m_bsdfSamples;
    bool usesLobe = false, usesDirection = false;
    m_vertices.forMaterialRuns(b.vertex, b.count, [&](const Material& m, int, int) {
        usesLobe |= m.flags().usesLobeSample;
        usesDirection |= m.flags().usesDirectionSample;
    });
    if (usesLobe)
        m_context.sampler.fill1D(ranges, vertexDimension(bounce, kDimBsdfLobe), b.uLobe);
    if (usesDirection)
        m_context.sampler.fill2D(ranges, vertexDimension(bounce, kDimBsdfDirection), b.u);
    const VertexSoA& origins = m_vertices.bySample(std::span(b.vertex).first(size_t(b.count)), 1);
    m_vertices.forMaterialRuns(b.vertex, b.count, [&](const Material& m, int begin, int end) {
        m.sampleSoA({m_vertices.bsdf, b.vertex, origins.woLocal, begin, end, nullptr}, b.uLobe, b.u, b.bsdf);
    });
    b.transformToWorld(origins);
}

} // namespace strobe
