#include "shading/path_vertices.h"

namespace strobe {

namespace {

void prefetchSurfaces(const Scene& scene, const PathBatch& batch, std::span<const uint32_t> paths) {
    Hit hits[kSoAWidth];
    for (size_t i = 0; i < paths.size(); ++i)
        hits[i] = batch.paths[paths[i]].hit;
    scene.prefetch(std::span(hits).first(paths.size()));
}

void computeFootprints(Counters& counters, const Material& material, int begin, int end, VertexChunk& v) {
    if (material.flags().needsFootprint) {
        footprints(v.surface, v.wo, v.coneWidth, begin, end, v.duvdx, v.duvdy);
        counters.footprints += uint64_t(end - begin);
    } else {
        for (float* row : {v.duvdx.x, v.duvdx.y, v.duvdy.x, v.duvdy.y})
            std::fill(row + begin, row + end, 0.f);
    }
}

/// Returns the shading normal `n` with the material's normal map applied.
V3f mappedNormal(const Scene& scene, const VertexChunk& v, int i, const V3f& n) {
    TangentFrame frame;
    scene.tangents(v.hits.at(i), v.time[i], frame.dpdu, frame.dpdv);
    frame.n = n;
    const TriangleMesh* mesh = scene.geometry(v.hits.at(i)).placed.shape.mesh.get();
    frame.hasVertexNormals = mesh && !mesh->normals.empty();
    return v.surface.material[i]->mappedNormal(v.textureQueries().at(i), frame);
}

/// Returns the shading normal `n`, turned as little as necessary for the mirror direction of `wo` to lie
/// above the geometric surface. `n`: as returned by visibleNormal.
V3f normalOfVisibleMirror(const V3f& n, const V3f& ng, const V3f& wo) {
    constexpr float kMinCosine = 0.02f;
    const float side = dot(wo, ng) < 0 ? -1.f : 1.f;
    const V3f up = ng * side;
    const V3f mirrored = n * (2 * dot(n, wo)) - wo;
    const float missing = std::min(kMinCosine, dot(wo, up)) - dot(mirrored, up);
    return missing > 0 ? normalizeAny(wo + normalizeAny(mirrored + up * missing)) * side : n;
}

/// Returns the shading normal `n`, turned until it lies above the surface and on the side of the viewer.
/// Otherwise, all light from the directions of the lobes would be discarded.
V3f visibleNormal(V3f n, const V3f& ng, const V3f& wo) {
    constexpr float kMinCosine = 0.01f;
    const V3f d = -wo;
    const V3f viewer = dot(d, ng) > 0 ? d : -d;
    n = normalize(n);
    for (const V3f& direction : {ng, viewer})
        if (const float c = dot(n, direction); c < kMinCosine)
            n = normalize(n + direction * (kMinCosine - c));
    return n;
}

void adjustShadingNormal(const Scene& scene, ShadingNormal kind, VertexChunk& v, int i) {
    V3f ng = v.surface.ng.at(i);
    V3f n = v.surface.ns.at(i);
    RawSurfacePoint::finishNormals(ng, n, v.surface.orientation[i]);
    const V3f wo = v.wo.at(i);
    if (kind == ShadingNormal::Mapped)
        n = normalOfVisibleMirror(visibleNormal(mappedNormal(scene, v, i, n), ng, wo), ng, wo);
    else
        n = visibleNormal(n, ng, wo);
    v.surface.ng.set(i, ng);
    v.surface.ns.set(i, n);
    v.surface.orientation[i] = 1;
}

} // namespace

void gatherHits(const Scene& scene, PathBatch& batch, std::span<const uint32_t> paths, VertexChunk& v) {
    if (scene.hasLargeMeshes())
        prefetchSurfaces(scene, batch, paths);
    v.count = 0;
    v.missedCount = 0;
    for (const uint32_t index : paths) {
        Path& path = batch.paths[index];
        path.sampledLightIsDirect = path.stage == PathStage::Camera;
        if (!path.hit) {
            v.missed[v.missedCount++] = index;
            continue;
        }
        if (path.isAbsorbed) // Beer's law
            for (int c = 0; c < 3; ++c)
                path.beta[c] *= std::exp(-path.absorption[c] * path.hit.t);
        const int i = v.count++;
        path.cone.width += path.hit.t * path.cone.spread;
        v.path[i] = index;
        v.hits.set(i, path.hit);
        v.coneWidth[i] = path.cone.width;
        v.coneSpread[i] = path.cone.spread;
        v.time[i] = path.ray.time;
        v.wo.set(i, -path.ray.d);
        v.beta.set(i, path.beta);
    }
}

void evaluateSurfaces(const Scene& scene, Counters& counters, VertexChunk& v) {
    scene.rawSurfaces(v.hits, v.time, v.count, v.surface);
    counters.surfaces += uint64_t(v.count);
}

namespace {

/// Replaces mixes by the materials that stand for them at each point.
void chooseMaterials(Counters& counters, VertexChunk& v) {
    const TextureQuerySoA queries = v.textureQueries();
    v.forMaterialRuns([&](const Material& material, int begin, int end) {
        const MaterialFlags& flags = material.flags();
        std::fill(v.isTextured + begin, v.isTextured + end, flags.textured);
        if (!flags.isMix)
            return;
        computeFootprints(counters, material, begin, end, v);
        for (int i = begin; i < end; ++i)
            v.surface.material[i] = &material.chosen(queries.at(i));
    });
}

} // namespace

void prepareBsdfs(Counters& counters, VertexChunk& v) {
    chooseMaterials(counters, v);
    const TextureQuerySoA queries = v.textureQueries();
    v.forMaterialRuns([&](const Material& material, int begin, int end) {
        for (int i = begin; i < end; ++i)
            v.bsdf[i].material = &material;
        const MaterialFlags& flags = material.flags();
        std::fill(v.isSmooth + begin, v.isSmooth + end, flags.smooth);
        std::fill(v.transmissive + begin, v.transmissive + end, flags.transmissive ? 1.f : 0.f);
        computeFootprints(counters, material, begin, end, v);
        material.prepareSoA(queries, begin, end, v.bsdf);
    });
}

void divideByAlbedo(PathBatch& batch, VertexChunk& v) {
    constexpr float kBlack = 1e-4f; // a black albedo carries no light to other points
    v.forMaterialRuns([&](const Material& material, int begin, int end) {
        for (int i = begin; i < end; ++i) {
            if (!v.isTextured[i])
                continue;
            Path& path = batch.paths[v.path[i]];
            if (path.component != LightComponent::Indirect)
                continue;
            const Rgb a = material.albedo(v.bsdf[i]);
            path.beta = {a.x > kBlack ? 1 / a.x : 0, a.y > kBlack ? 1 / a.y : 0, a.z > kBlack ? 1 / a.z : 0};
            v.beta.set(i, path.beta);
        }
    });
}

void adjustShadingNormals(const Scene& scene, VertexChunk& v) {
    v.forMaterialRuns([&](const Material& material, int begin, int end) {
        const ShadingNormal kind = material.flags().shadingNormal;
        if (kind == ShadingNormal::AsIs)
            return;
        for (int i = begin; i < end; ++i)
            adjustShadingNormal(scene, kind, v, i);
    });
}

void recordEmission(PathBatch& batch, std::span<const uint32_t> paths) {
    for (const uint32_t path : paths)
        batch.firstVertices[path].emitted = batch.paths[path].radiance;
}

void recordFirstVertices(PathBatch& batch, const VertexChunk& v) {
    for (int i = 0; i < v.count; ++i) {
        const Path& path = batch.paths[v.path[i]];
        FirstVertex& first = batch.firstVertices[v.path[i]];
        if (path.recorded == PathStage::FirstHit) {
            first.indirect = path.radiance; // before any indirect light
            first.hasIndirect = true;
        }
        if (!v.isSmooth[i] || v.isSharp[i] || path.recorded != PathStage::Camera || first.hit)
            continue;
        const Material& material = *v.surface.material[i];
        first.albedo = v.beta.at(i);
        if (v.isTextured[i] || material.flags().viewDependent)
            first.albedo *= material.reflectance(v.bsdf[i], v.woLocal.at(i));
        first.hit = v.hits.at(i);
        first.p = v.p.at(i);
        first.isFront = v.cosWo[i] > 0;
        first.n = first.isFront ? v.ng.at(i) : -v.ng.at(i);
        first.ns = first.isFront ? v.n.at(i) : -v.n.at(i);
        first.hasMappedNormal = material.flags().shadingNormal == ShadingNormal::Mapped;
        first.dpdu = v.surface.dpdu.at(i);
        first.coneWidth = v.coneWidth[i];
        first.direct = path.radiance; // before direct light
    }
}

} // namespace strobe
