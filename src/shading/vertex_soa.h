// The vertices of many paths side by side, and what is computed of them so.
#pragma once

#include "core/scene/scene.h"

namespace strobe {

/// What the light of vertices is computed from, in rows of kLanes numbers. Directions and points are the
/// world's, but for woLocal.
struct VertexRows {
    V3Lanes p, ng;
    V3Lanes s, t, n; ///< the shading frame
    V3Lanes woLocal;
    RgbLanes beta;
    alignas(64) float time[kLanes], offset[kLanes];
    alignas(64) float side[kLanes];      ///< dot(wo, ng)
    alignas(64) float transmits[kLanes]; ///< 1 where the material lets light through, else 0

    /// Becomes the rows of some vertices of `from`, each `times` times in a row.
    void repeat(const VertexRows& from, const int32_t* vertices, int count, int times);
};

/// Vertices with their BSDFs ready.
struct VertexLanes : VertexRows {
    int count = 0;
    uint32_t path[kLanes];
    const Material* material[kLanes];
    Bsdf bsdf[kLanes];
    V3Lanes wo;
    alignas(64) float scale[kLanes], orientation[kLanes]; ///< of RawSurfacePoint
    alignas(64) float maxPdf[kLanes];
    bool isSmooth[kLanes]; ///< as the material

    /// Takes points and normals, of which `finish` makes those of SurfacePoints.
    void setSurfaces(const SurfaceLanes& from);
    /// Completes the points, the frames, and what follows from them.
    void finish();

    Frame frame(int i) const { return {s.at(i), t.at(i), n.at(i)}; }
    /// The ray that leaves vertex i towards `wi`.
    Ray leave(int i, const V3f& wi) const {
        return {p.at(i), wi, time[i], clearOf(offset[i], dot(wi, ng.at(i)))};
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
struct LightLanes {
    int count = 0;
    alignas(64) int32_t vertex[kLanes];
    alignas(64) int32_t useful[kLanes]; ///< 0: brings no light
    LightSampleLanes light;
    V3Lanes local; ///< light.wi in the vertex's frame
    RgbLanes f;
    alignas(64) float pdf[kLanes];    ///< of the BSDF
    alignas(64) float cosine[kLanes]; ///< with the geometric normal
    alignas(64) float bsdfShare[kLanes];
    alignas(64) float weight[kLanes]; ///< against BSDF samples
    alignas(64) float tmin[kLanes], tmax[kLanes];
    RgbLanes contribution;

    /// Fills `local`, `cosine` and `useful`; true when something is.
    bool findUseful(const VertexRows& at);
    /// Fills `contribution`, `tmin` and `tmax`, and completes `useful`. `n`: how many samples, times the
    /// probability of the light; `weighs`: bsdfShare of the BSDF's samples compete with them.
    void weigh(const VertexRows& at, float n, bool weighs);
};

/// Turns directions from the frames of vertices to the world, unit length; with their cosine with the
/// geometric normal.
void turnToWorld(const VertexRows& at, int n, const V3Lanes& local, V3Lanes& world, float* cosine);

} // namespace strobe
