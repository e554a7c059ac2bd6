// Structures of arrays of light samples and BSDF samples at the vertices of a chunk.
#pragma once

#include "shading/vertex_chunk.h"

#include <span>

namespace strobe {

/// The light that a shadow ray is sent to.
struct RayTarget {
    int light;
    uint32_t id; ///< see RayPacket
};

/// Writes each vertex `count` times; at most kSoAWidth values. Returns their number.
inline int repeatVertices(std::span<const int32_t> vertices, int count, int32_t* out) {
    int n = 0;
    for (const int32_t vertex : vertices)
        for (int k = 0; k < count; ++k)
            out[n++] = vertex;
    return n;
}

/// Up to kSoAWidth samples of one light, or of emitters that the light tree chose. All members are by sample.
/// `origins` below are the samples' vertices.
struct LightSampleChunk {
    int count = 0;
    alignas(64) int32_t vertex[kSoAWidth];
    alignas(64) float bsdfSamples[kSoAWidth]; ///< number of BSDF samples to combine with; 0: none
    V2SoA u;                                  ///< in [0,1)²
    LightSampleSoA light;
    RayTarget target[kSoAWidth];                ///< of emitters that the light tree chose
    V3SoA wiLocal;                              ///< light.wi in the shading frame
    alignas(64) float cosWi[kSoAWidth];         ///< dot(light.wi, ng)
    alignas(64) int32_t contributes[kSoAWidth]; ///< 0: the contribution is black
    RgbSoA f;                                   ///< BSDF times |cos|
    alignas(64) float bsdfPdf[kSoAWidth];       ///< of drawing light.wi from the BSDF, per solid angle
    alignas(64) float misWeight[kSoAWidth];
    RgbSoA contribution;                                ///< to the path's radiance, if the light is visible
    alignas(64) float tmin[kSoAWidth], tmax[kSoAWidth]; ///< of the shadow ray

    /// Computes wiLocal, cosWi and `contributes` from `light`. Returns false if no sample contributes.
    bool findContributing(const VertexSoA& origins);
    /// Computes `contribution`, tmin and tmax from f, and clears `contributes` where the contribution is
    /// black. `expectedSamples` is the number of light samples per vertex times the probability that the
    /// light is sampled. With `usesMis`, weights the samples by the power heuristic (Veach and Guibas 1995)
    /// against `bsdfSamples` samples of the BSDF.
    void computeContributions(const VertexSoA& origins, float expectedSamples, bool usesMis);
};

/// Up to kSoAWidth BSDF samples. All members are by sample.
struct BsdfSampleChunk {
    int count = 0;
    alignas(64) int32_t vertex[kSoAWidth];
    V2SoA u;                            ///< for the direction, in [0,1)²
    alignas(64) float uLobe[kSoAWidth]; ///< for the choice of a lobe, in [0,1)
    BsdfSampleSoA bsdf;                 ///< samples in the shading frame
    V3SoA wi;                           ///< bsdf.wi in world space
    alignas(64) float cosWi[kSoAWidth]; ///< dot(wi, ng)

    /// Computes wi and cosWi from bsdf.wi.
    void transformToWorld(const VertexSoA& origins);
    /// Returns false when sample i was absorbed, or when wi lies on the wrong side of the surface for its
    /// lobe: a shading normal may send a reflection through the surface. `cosWo` = dot(wo, ng).
    bool isValid(int i, float cosWo) const {
        return bsdf.valid[i] && (cosWi[i] * cosWo > 0) != bsdf.transmits[i];
    }
};

/// BSDF samples that may hit one light. All members are by sample.
struct LightRayChunk : BsdfSampleChunk {
    alignas(64) int32_t mayHitLight[kSoAWidth];
    RgbSoA f;                              ///< BSDF times |cos|
    alignas(64) float bsdfPdf[kSoAWidth];  ///< per solid angle
    RgbSoA background;                     ///< radiance of an environment light along wi
    alignas(64) float lightPdf[kSoAWidth]; ///< of drawing wi from the environment light, per solid angle

    /// Says whether sample i may hit a light. If not, its directions, which may be invalid, become unit
    /// vectors.
    void setMayHitLight(int i, bool mayHit) {
        mayHitLight[i] = mayHit;
        if (!mayHit) {
            wi.set(i, V3f(0, 0, 1));
            bsdf.wi.set(i, V3f(0, 0, 1));
        }
    }
};

} // namespace strobe
