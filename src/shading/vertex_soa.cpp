#include "shading/vertex_soa.h"

#include "core/math/sampling.h"

#include <numeric>

namespace strobe {

namespace {

constexpr int kRows = sizeof(VertexRows) / (kSoAWidth * sizeof(float));
static_assert(kRows * kSoAWidth * sizeof(float) == sizeof(VertexRows));

template <int kTimes>
inline void repeatRows(const float* from, float* to, const int32_t* vertices, int count, int times) {
    for (int row = 0; row < kRows; ++row, from += kSoAWidth, to += kSoAWidth)
        for (int i = 0; i < count; ++i) {
            const float value = from[vertices[i]];
            float* place = to + i * (kTimes ? kTimes : times);
            for (int k = 0; k < (kTimes ? kTimes : times); ++k)
                place[k] = value;
        }
}

STROBE_TARGET_CLONES void repeatRowsBy(const float* from, float* to, const int32_t* vertices, int count,
                                       int times) {
    if (times == 1)
        repeatRows<1>(from, to, vertices, count, times);
    else if (times == 4)
        repeatRows<4>(from, to, vertices, count, times);
    else if (times == 8)
        repeatRows<8>(from, to, vertices, count, times);
    else
        repeatRows<0>(from, to, vertices, count, times);
}

STROBE_TARGET_CLONES void completePoints(VertexSoA& v) {
    const int n = v.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f wo = v.wo.at(i);
        V3f ng = v.ng.at(i), ns = v.n.at(i);
        RawSurfacePoint::finishNormals(ng, ns, v.orientation[i]);
        v.ng.x[i] = ng.x, v.ng.y[i] = ng.y, v.ng.z[i] = ng.z;
        v.n.x[i] = ns.x, v.n.y[i] = ns.y, v.n.z[i] = ns.z;
        v.offset[i] = RawSurfacePoint::offsetOf(v.scale[i], v.p.at(i));
        const Frame f = Frame::fromNormal(ns);
        v.s.x[i] = f.s.x, v.s.y[i] = f.s.y, v.s.z[i] = f.s.z;
        v.t.x[i] = f.t.x, v.t.y[i] = f.t.y, v.t.z[i] = f.t.z;
        v.woLocal.x[i] = dot(wo, f.s), v.woLocal.y[i] = dot(wo, f.t), v.woLocal.z[i] = dot(wo, f.n);
        v.side[i] = dot(wo, ng);
    }
}

STROBE_TARGET_CLONES void turnLights(const VertexRows& at, LightSoA& l) {
    const int n = l.count;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f wi = l.light.wi.at(i);
        l.local.x[i] = dot(wi, at.s.at(i));
        l.local.y[i] = dot(wi, at.t.at(i));
        l.local.z[i] = dot(wi, at.n.at(i));
        const float cosine = dot(wi, at.ng.at(i));
        l.cosine[i] = cosine;
        const int32_t shines =
            (l.light.radiance.r[i] != 0) | (l.light.radiance.g[i] != 0) | (l.light.radiance.b[i] != 0);
        const int32_t passes = (cosine * at.side[i] > 0) | (at.transmits[i] > 0);
        l.useful[i] = shines & (l.light.pdf[i] > 0) & passes;
    }
}

STROBE_TARGET_CLONES void weighAgainst(LightSoA& l, float n) {
    const int count = l.count;
    STROBE_IVDEP
    for (int i = 0; i < count; ++i)
        l.weight[i] = powerHeuristic(n, l.light.pdf[i], l.bsdfShare[i], l.pdf[i]);
}

STROBE_TARGET_CLONES void contribute(const VertexRows& at, LightSoA& l, float n) {
    const int count = l.count;
    STROBE_IVDEP
    for (int i = 0; i < count; ++i) {
        const float scale = l.weight[i] / (l.light.pdf[i] * n);
        const float r = at.beta.r[i] * l.f.r[i] * l.light.radiance.r[i] * scale;
        const float g = at.beta.g[i] * l.f.g[i] * l.light.radiance.g[i] * scale;
        const float b = at.beta.b[i] * l.f.b[i] * l.light.radiance.b[i] * scale;
        l.contribution.r[i] = r, l.contribution.g[i] = g, l.contribution.b[i] = b;
        l.useful[i] &= (r != 0) | (g != 0) | (b != 0);
        l.tmin[i] = tminFor(at.offset[i], l.cosine[i]);
        l.tmax[i] = l.light.distance[i] * 0.9999f; // stop short of the light's own surface
    }
}

STROBE_TARGET_CLONES void turnSoA(const VertexRows& at, int n, const V3SoA& local, V3SoA& world,
                                  float* cosine) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const V3f w = normalize(at.s.at(i) * local.x[i] + at.t.at(i) * local.y[i] + at.n.at(i) * local.z[i]);
        world.x[i] = w.x, world.y[i] = w.y, world.z[i] = w.z;
        cosine[i] = dot(w, at.ng.at(i));
    }
}

} // namespace

void VertexRows::repeat(const VertexRows& from, const int32_t* vertices, int count, int times) {
    repeatRowsBy(reinterpret_cast<const float*>(&from), reinterpret_cast<float*>(this), vertices, count,
                 times);
}

void VertexSoA::setSurfaces(const SurfaceSoA& from) {
    p = from.p, ng = from.ng, n = from.ns;
    std::copy_n(from.scale, kSoAWidth, scale);
    std::copy_n(from.orientation, kSoAWidth, orientation);
}

void VertexSoA::finish() {
    completePoints(*this);
    alignas(64) int32_t vertices[kSoAWidth];
    std::iota(vertices, vertices + count, 0);
    forMaterials(vertices, count, [&](const Material& m, int begin, int end) {
        m.maxPdfSoA({bsdf, vertices, woLocal, begin, end, nullptr}, maxPdf);
    });
}

bool LightSoA::findUseful(const VertexRows& at) {
    turnLights(at, *this);
    int32_t any = 0;
    for (int i = 0; i < count; ++i)
        any |= useful[i];
    return any;
}

void LightSoA::weigh(const VertexRows& at, float n, bool weighs) {
    if (weighs)
        weighAgainst(*this, n);
    else
        std::fill(weight, weight + count, 1.f);
    contribute(at, *this, n);
}

void turnToWorld(const VertexRows& at, int n, const V3SoA& local, V3SoA& world, float* cosine) {
    turnSoA(at, n, local, world, cosine);
}

} // namespace strobe
