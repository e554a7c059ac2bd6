#include "shading/emitted_light.h"

#include "core/math/sampling.h"

namespace strobe {

namespace {

/// Returns the expected number of samples that the previous vertex took of a light, or of the emitter with
/// triangle `prim`.
float expectedLightSamples(const PathContext& context, const Path& path, int light, uint32_t prim) {
    const PathSettings& settings = context.settings;
    if (context.lightTree)
        return float(settings.treeSamples(path.stage == PathStage::FirstHit)) *
               context.lightTree->probability(path.previousVertex(), light, prim);
    return path.sampledAllLights ? float(settings.samplesOf(*context.scene.lights()[size_t(light)]))
                                 : context.lightSampler.probability(light);
}

/// Returns the density of samples of the light at `s`, or, with a light tree, of its emitter.
float hitLightPdf(const PathContext& context, const SurfacePoint& s, const V3f& p, float time,
                  const V3f& wi) {
    if (!context.lightTree)
        return lightPdf(context.scene, s, p, time, wi);
    const LightHit hit{s.p, s.ng, length(s.p - p), s.prim};
    const uint32_t emitter = context.lightTree->emitterOf(s.light, s.prim);
    return context.scene.lights()[size_t(s.light)]->emitterPdf(emitter, p, time, wi, &hit);
}

/// Returns the MIS weight of light `lightIndex` that the path's last ray hit, or 0 where the path's component
/// excludes it. `pdf()` returns the pdf of light samples in the ray's direction, per solid angle; it is
/// called only if needed.
template <class LightPdf>
float hitLightWeight(const PathContext& context, const Path& path, int lightIndex, uint32_t prim, int bounce,
                     const LightPdf& pdf) {
    const bool isIndirect = path.component == LightComponent::Indirect;
    if (isIndirect && bounce == 0)
        return 0; // emission of the first surface
    if (path.specularBounce)
        return 1;
    if (isIndirect && bounce == 1)
        return 0; // its direct light, without that of delta lobes
    const Light& light = *context.scene.lights()[size_t(lightIndex)];
    if (light.isDelta() || !usesMis(path.maxBsdfPdf, light.solidAngle(path.previousP, path.ray.time)))
        return 0;
    return powerHeuristic(1, path.bsdfPdf, expectedLightSamples(context, path, lightIndex, prim), pdf());
}

void addEmissionOf(const PathContext& context, PathBatch& batch, uint32_t pathIndex, RawSurfacePoint s,
                   int bounce) {
    const Path& path = batch.paths[pathIndex];
    s.finish();
    const Rgb radiance = context.scene.emitted(s, path.hit, -path.ray.d);
    if (isBlack(radiance))
        return;
    const float weight = hitLightWeight(context, path, s.light, s.prim, bounce, [&] {
        return hitLightPdf(context, s, path.previousP, path.ray.time, path.ray.d);
    });
    batch.addHitLight(pathIndex, s.light, path.beta * radiance * weight);
}

} // namespace

float lightPdf(const Scene& scene, const SurfacePoint& s, const V3f& p, float time, const V3f& wi) {
    const LightHit hit{s.p, s.ng, length(s.p - p), s.prim};
    return scene.lights()[size_t(s.light)]->pdf(p, time, wi, &hit);
}

float treeLightRayWeight(const PathContext& context, const Path& path, float bsdfPdf, const SurfacePoint& s,
                         const V3f& wi) {
    const LightPoint vertex = path.previousVertex();
    const Light& light = *context.scene.lights()[size_t(s.light)];
    if (light.isDelta() || !usesMis(path.maxBsdfPdf, light.solidAngle(vertex.p, vertex.time)))
        return 0;
    const float pdf = context.lightTree->probability(vertex, s.light, s.prim) *
                      hitLightPdf(context, s, vertex.p, vertex.time, wi);
    return powerHeuristic(1, bsdfPdf, 1, pdf);
}

void addBackground(const PathContext& context, PathBatch& batch, const VertexChunk& v, int bounce) {
    const int count = v.missedCount;
    if (count == 0 || context.scene.environments().empty() ||
        (bounce == 0 && !context.scene.showsBackground()))
        return;
    V3SoA d;
    RgbSoA radiance;
    alignas(64) float pdf[kSoAWidth];
    bool needsPdf = false;
    for (int i = 0; i < count; ++i) {
        const Path& path = batch.paths[v.missed[i]];
        d.set(i, path.ray.d);
        needsPdf |= !path.specularBounce;
    }
    for (int light : context.scene.environments()) {
        context.scene.lights()[size_t(light)]->environmentSoA(d, count, radiance, needsPdf ? pdf : nullptr);
        for (int i = 0; i < count; ++i) {
            const Rgb arriving = radiance.at(i);
            if (isBlack(arriving))
                continue;
            const Path& path = batch.paths[v.missed[i]];
            const float weight = hitLightWeight(context, path, light, 0, bounce, [&] { return pdf[i]; });
            batch.addHitLight(v.missed[i], light, path.beta * arriving * weight);
        }
    }
}

void addEmission(const PathContext& context, PathBatch& batch, const VertexChunk& v, int bounce) {
    for (int i = 0; i < v.count; ++i)
        if (v.surface.light[i] >= 0)
            addEmissionOf(context, batch, v.path[i], v.surface.at(i), bounce);
}

} // namespace strobe
