// The vertices of many paths side by side, and what is computed of them so.
#pragma once

#include "core/scene/scene.h"

namespace strobe {

/// What the light of vertices is computed from, in rows of kSoAWidth numbers. Directions and points are the
/// world's, but for woLocal.
struct VertexRows {
    V3SoA p, ng;
    V3SoA s, t, n; ///< the shading frame
    V3SoA woLocal;
    RgbSoA beta;
    alignas(64) float time[kSoAWidth], offset[kSoAWidth];
    alignas(64) float side[kSoAWidth];      ///< dot(wo, ng)
    alignas(64) float transmits[kSoAWidth]; ///< 1 where the material lets light through, else 0

    /// Becomes the rows of some vertices of `from`, each `times` times in a row.
    void repeat(const VertexRows& from, const int32_t* vertices, int count, int times);
};

/// Vertices with their BSDFs ready.
struct VertexSoA : VertexRows {
    int count = 0;
    uint32_t path[kSoAWidth];
    const Material* material[kSoAWidth];
    Bsdf bsdf[kSoAWidth];
    V3SoA wo;
    alignas(64) float scale[kSoAWidth], orientation[kSoAWidth]; ///< of RawSurfacePoint
    alignas(64) float maxPdf[kSoAWidth];
    bool isSmooth[kSoAWidth]; ///< as the material

    /// Takes points and normals, of which `finish` makes those of SurfacePoints.
    void setSurfaces(const SurfaceSoA& from);
    /// Completes the points, the frames, and what follows from them.
    void finish();

    Frame frame(int i) const { return {s.at(i), t.at(i), n.at(i)}; }
    /// The ray that leaves vertex i towards `wi`.
    Ray leave(int i, const V3f& wi) const {
        return {p.at(i), wi, time[i], tminFor(offset[i], dot(wi, ng.at(i)))};
    }
    /// Calls work(material, begin, end) for runs of jobs at vertices of one material; `vertex`: by job.
    template <class Work>
    void forMaterials(const int32_t* vertex, int jobs, const Work& work) const {
        for (int begin = 0, end; begin < jobs; begin = end) {
            const Material* m = material[vertex[begin]];
            for (end = begin; end < jobs && material[vertex[end]] == m; ++end) {
            }
            work(*m, begin, end);
        }
    }
};

/// Samples of one light on their way to becoming shadow rays; all by sample.
struct LightSoA {
    int count = 0;
    alignas(64) int32_t vertex[kSoAWidth];
    alignas(64) int32_t useful[kSoAWidth]; ///< 0: brings no light
    LightSampleSoA light;
    V3SoA local; ///< light.wi in the vertex's frame
    RgbSoA f;
    alignas(64) float pdf[kSoAWidth];    ///< of the BSDF
    alignas(64) float cosine[kSoAWidth]; ///< with the geometric normal
    alignas(64) float bsdfShare[kSoAWidth];
    alignas(64) float weight[kSoAWidth]; ///< against BSDF samples
    alignas(64) float tmin[kSoAWidth], tmax[kSoAWidth];
    RgbSoA contribution;

    /// Fills `local`, `cosine` and `useful`; true when something is.
    bool findUseful(const VertexRows& at);
    /// Fills `contribution`, `tmin` and `tmax`, and completes `useful`. `n`: how many samples, times the
    /// probability of the light; `weighs`: bsdfShare of the BSDF's samples compete with them.
    void weigh(const VertexRows& at, float n, bool weighs);
};

/// Turns directions from the frames of vertices to the world, unit length; with their cosine with the
/// geometric normal.
void turnToWorld(const VertexRows& at, int n, const V3SoA& local, V3SoA& world, float* cosine);

} // namespace strobe
