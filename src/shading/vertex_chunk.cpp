#include "shading/vertex_chunk.h"

#include <numeric>

namespace strobe {

namespace {

constexpr int kRows = sizeof(VertexSoA) / (kSoAWidth * sizeof(float));
static_assert(kRows * kSoAWidth * sizeof(float) == sizeof(VertexSoA));

/// Implements VertexSoA::gather. kRepetitions is 0 if `repetitions` is not known at compile time.
template <int kRepetitions>
inline void gatherRows(const float* from, float* to, const int32_t* vertices, int count, int repetitions) {
    const int n = kRepetitions ? kRepetitions : repetitions;
    for (int row = 0; row < kRows; ++row, from += kSoAWidth, to += kSoAWidth)
        for (int i = 0; i < count; ++i) {
            const float value = from[vertices[i]];
            float* copies = to + i * n;
            for (int k = 0; k < n; ++k)
                copies[k] = value;
        }
}

STROBE_TARGET_CLONES void gatherRowsTimes(const float* from, float* to, const int32_t* vertices, int count,
                                          int repetitions) {
    if (repetitions == 1)
        gatherRows<1>(from, to, vertices, count, repetitions);
    else if (repetitions == 4)
        gatherRows<4>(from, to, vertices, count, repetitions);
    else if (repetitions == 8)
        gatherRows<8>(from, to, vertices, count, repetitions);
    else
        gatherRows<0>(from, to, vertices, count, repetitions);
}

STROBE_TARGET_CLONES void computeFrames(VertexChunk& v) {
    const int n = v.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f p = v.surface.p.at(i);
        v.p.x[i] = p.x;
        v.p.y[i] = p.y;
        v.p.z[i] = p.z;
        v.offset[i] = RawSurfacePoint::offsetOf(v.surface.scale[i], p);
        V3f ng = v.surface.ng.at(i);
        V3f ns = v.surface.ns.at(i);
        RawSurfacePoint::finishNormals(ng, ns, v.surface.orientation[i]);
        v.ng.x[i] = ng.x;
        v.ng.y[i] = ng.y;
        v.ng.z[i] = ng.z;
        const Frame f = Frame::fromNormal(ns);
        v.s.x[i] = f.s.x;
        v.s.y[i] = f.s.y;
        v.s.z[i] = f.s.z;
        v.t.x[i] = f.t.x;
        v.t.y[i] = f.t.y;
        v.t.z[i] = f.t.z;
        v.n.x[i] = ns.x;
        v.n.y[i] = ns.y;
        v.n.z[i] = ns.z;
        const V3f wo = v.wo.at(i);
        v.woLocal.x[i] = dot(wo, f.s);
        v.woLocal.y[i] = dot(wo, f.t);
        v.woLocal.z[i] = dot(wo, f.n);
        v.cosWo[i] = dot(wo, ng);
    }
}

/// Turns the shading frame of a vertex such that its x axis lies along dp/du.
void alignFrame(const Scene& scene, VertexChunk& v, int i) {
    V3f dpdu, dpdv;
    scene.tangents(v.hits.at(i), v.time[i], dpdu, dpdv);
    const Frame f = Frame::fromNormalTangent(v.n.at(i), dpdu);
    v.s.set(i, f.s);
    v.t.set(i, f.t);
    v.woLocal.set(i, f.toLocal(v.wo.at(i)));
}

/// Returns VertexChunk::isSharp. Lobes are narrow if their solid angle is below that of kPixels pixels.
bool isSharp(const VertexChunk& v, int i) {
    constexpr float kPixels = 160;
    constexpr float kSpreadOfParallels = 0.005f; // of pixels, where camera rays are parallel
    const float spread = v.coneSpread[i] > 0 ? v.coneSpread[i] : kSpreadOfParallels;
    const Bsdf& bsdf = v.bsdf[i];
    return v.maxPdf[i] <= 0 || (v.maxPdf[i] * sqr(spread) * kPixels > 1 && bsdf.material->isSpecular(bsdf));
}

} // namespace

void VertexSoA::gather(const VertexSoA& from, std::span<const int32_t> vertices, int repetitions) {
    gatherRowsTimes(reinterpret_cast<const float*>(&from), reinterpret_cast<float*>(this), vertices.data(),
                    int(vertices.size()), repetitions);
}

void completeVertices(const Scene& scene, VertexChunk& v) {
    computeFrames(v);
    alignas(64) int32_t vertices[kSoAWidth];
    std::iota(vertices, vertices + v.count, 0);
    v.forMaterialRuns([&](const Material& m, int begin, int end) {
        for (int i = begin; m.flags().needsTangents && i < end; ++i)
            alignFrame(scene, v, i);
        m.maxPdfSoA({v.bsdf, vertices, v.woLocal, begin, end, nullptr}, v.maxPdf);
        for (int i = begin; i < end; ++i)
            v.isSharp[i] = isSharp(v, i);
    });
}

} // namespace strobe
