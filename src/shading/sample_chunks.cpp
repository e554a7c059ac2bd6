#include "shading/sample_chunks.h"

#include "core/math/sampling.h"

namespace strobe {

namespace {

STROBE_TARGET_CLONES void transformToLocal(const VertexSoA& origins, LightSampleChunk& l) {
    const int n = l.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f wi = l.light.wi.at(i);
        l.wiLocal.x[i] = dot(wi, origins.s.at(i));
        l.wiLocal.y[i] = dot(wi, origins.t.at(i));
        l.wiLocal.z[i] = dot(wi, origins.n.at(i));
        const float cosWi = dot(wi, origins.ng.at(i));
        l.cosWi[i] = cosWi;
        const int32_t hasRadiance =
            (l.light.radiance.r[i] != 0) | (l.light.radiance.g[i] != 0) | (l.light.radiance.b[i] != 0);
        const int32_t hasLobe = (cosWi * origins.cosWo[i] > 0) | (origins.transmissive[i] > 0);
        l.contributes[i] = hasRadiance & (l.light.pdf[i] > 0) & hasLobe;
    }
}

STROBE_TARGET_CLONES void computeMisWeights(LightSampleChunk& l, float expectedSamples) {
    const int n = l.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        l.misWeight[i] = powerHeuristic(expectedSamples, l.light.pdf[i], l.bsdfSamples[i], l.bsdfPdf[i]);
}

STROBE_TARGET_CLONES void computeShadowRays(const VertexSoA& origins, LightSampleChunk& l,
                                            float expectedSamples) {
    const int n = l.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const float scale = l.misWeight[i] / (l.light.pdf[i] * expectedSamples);
        const float r = origins.beta.r[i] * l.f.r[i] * l.light.radiance.r[i] * scale;
        const float g = origins.beta.g[i] * l.f.g[i] * l.light.radiance.g[i] * scale;
        const float b = origins.beta.b[i] * l.f.b[i] * l.light.radiance.b[i] * scale;
        l.contribution.r[i] = r;
        l.contribution.g[i] = g;
        l.contribution.b[i] = b;
        l.contributes[i] &= (r != 0) | (g != 0) | (b != 0);
        l.tmin[i] = tminFor(origins.offset[i], l.cosWi[i]);
        l.tmax[i] = l.light.distance[i] * 0.9999f; // stop short of the light's own surface
    }
}

STROBE_TARGET_CLONES void localToWorld(const VertexSoA& origins, BsdfSampleChunk& samples) {
    const int n = samples.count;
    const V3SoA& local = samples.bsdf.wi;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f wi = normalize(origins.s.at(i) * local.x[i] + origins.t.at(i) * local.y[i] +
                                 origins.n.at(i) * local.z[i]);
        samples.wi.x[i] = wi.x;
        samples.wi.y[i] = wi.y;
        samples.wi.z[i] = wi.z;
        samples.cosWi[i] = dot(wi, origins.ng.at(i));
    }
}

} // namespace

bool LightSampleChunk::findContributing(const VertexSoA& origins) {
    transformToLocal(origins, *this);
    int32_t any = 0;
    for (int i = 0; i < count; ++i)
        any |= contributes[i];
    return any;
}

void LightSampleChunk::computeContributions(const VertexSoA& origins, float expectedSamples, bool usesMis) {
    if (usesMis)
        computeMisWeights(*this, expectedSamples);
    else
        std::fill(misWeight, misWeight + count, 1.f);
    computeShadowRays(origins, *this, expectedSamples);
}

void BsdfSampleChunk::transformToWorld(const VertexSoA& origins) { localToWorld(origins, *this); }

} // namespace strobe
