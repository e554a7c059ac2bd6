// Structures of arrays of path vertices.
#pragma once

#include "core/scene/scene.h"

#include <algorithm>
#include <span>

namespace strobe {

/// The inputs of light samples and BSDF samples, by vertex or, after `gather`, by sample. All members are
/// rows of kSoAWidth numbers. World space, except for woLocal.
struct VertexSoA {
    V3SoA p, ng;                               ///< ng: unit geometric normal, the surface's own side
    V3SoA s, t, n;                             ///< the shading frame
    V3SoA woLocal;                             ///< in the shading frame
    RgbSoA beta;                               ///< throughput of the path up to the vertex
    alignas(64) float time[kSoAWidth];         ///< shutter fraction
    alignas(64) float offset[kSoAWidth];       ///< SurfacePoint::offset
    alignas(64) float cosWo[kSoAWidth];        ///< dot(wo, ng)
    alignas(64) float transmissive[kSoAWidth]; ///< 1 where the material transmits light, else 0

    /// Copies `vertices` of `from`, each `repetitions` times in a row: at most kSoAWidth copies.
    void gather(const VertexSoA& from, std::span<const int32_t> vertices, int repetitions);
};

/// The vertices of up to kSoAWidth paths. The functions of path_vertices.h fill it, step by step.
struct VertexChunk : VertexSoA {
    int count = 0;
    uint32_t path[kSoAWidth]; ///< index into PathBatch::paths
    int missedCount = 0;
    uint32_t missed[kSoAWidth]; ///< paths of the chunk without a hit: they have no vertex
    HitSoA hits;
    V3SoA wo;
    alignas(64) float coneWidth[kSoAWidth], coneSpread[kSoAWidth]; ///< of the path's ray cone
    SurfaceSoA surface;
    V2SoA duvdx, duvdy; ///< texture footprint; 0 where the material needs none
    Bsdf bsdf[kSoAWidth];
    bool isSmooth[kSoAWidth];            ///< MaterialFlags::smooth
    bool isSharp[kSoAWidth];             ///< a mirror, or Material::isSpecular with narrow lobes
    bool isTextured[kSoAWidth];          ///< MaterialFlags::textured, of a mix before the choice
    alignas(64) float maxPdf[kSoAWidth]; ///< an upper bound of the BSDF's pdf per solid angle

    TextureQuerySoA textureQueries() const {
        return {surface.uv, surface.p, duvdx, duvdy, surface.prim, hits.u, hits.v, surface.ng, coneWidth};
    }
    /// Returns the inputs of the light tree's importance at vertex i.
    LightPoint lightPoint(int i) const {
        const float side = cosWo[i] < 0 ? -1.f : 1.f;
        return {p.at(i), ng.at(i) * side, n.at(i) * side, transmissive[i] != 0, time[i]};
    }
    /// Returns the ray that leaves vertex i along `wi` (unit); `cosWi` = dot(wi, ng).
    Ray spawnRay(int i, const V3f& wi, float cosWi) const {
        return {p.at(i), wi, time[i], tminFor(offset[i], cosWi)};
    }
    /// Returns `vertices` (in ascending order), each `samples` times in a row. Valid until the next call.
    const VertexSoA& bySample(std::span<const int32_t> vertices, int samples) {
        if (samples == 1 && int(vertices.size()) == count)
            return *this; // all vertices
        m_bySample.gather(*this, vertices, samples);
        return m_bySample;
    }
    /// Calls work(material, begin, end) for each run of vertices of one material.
    template <class Work>
    void forMaterialRuns(const Work& work) const {
        for (int begin = 0, end; begin < count; begin = end) {
            const Material* m = surface.material[begin];
            for (end = begin; end < count && surface.material[end] == m; ++end) {
            }
            work(*m, begin, end);
        }
    }
    /// Calls work(material, begin, end) for each run of samples at vertices of one material. `vertex` holds
    /// the vertices of samples 0 … n-1.
    template <class Work>
    void forMaterialRuns(const int32_t* vertex, int n, const Work& work) const {
        for (int begin = 0, end; begin < n; begin = end) {
            const Material* m = surface.material[vertex[begin]];
            for (end = begin; end < n && surface.material[vertex[end]] == m; ++end) {
            }
            work(*m, begin, end);
        }
    }

  private:
    VertexSoA m_bySample;
};

/// Computes normals, shading frames, offsets and BSDF pdf bounds of the vertices from their surfaces and
/// BSDFs: the last step of filling a chunk.
void completeVertices(const Scene& scene, VertexChunk& v);

} // namespace strobe
