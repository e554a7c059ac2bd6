// The material seam: a Material turns textures into a Bsdf once per shaded point, then evaluates it.
//
// Directions are in the local shading frame: z is the shading normal as the surface defines it (not turned
// towards the viewer), so wo.z may be negative: reflection lobes are two-sided and must treat (wo, wi) and
// (-wo, -wi) alike; transmissive materials read the side from the sign of wo.z (positive: outside). wo and wi
// both point away from the surface; wo is towards the viewer. Whether a pair reflects or transmits is decided
// by the caller, from geometric normals; lobes take |cos| of both directions and do not check hemispheres in
// evalCos (pbrt-v2's rule: a lobe may be evaluated slightly below the shading horizon), but `pdf` is the
// density with which `sample` really draws wi, so it is zero where sample never goes.
#pragma once

#include "core/interfaces/texture.h"
#include "core/math/soa.h"

#include <cstddef>
#include <type_traits>

namespace strobe {

class Material;

/// A material at one point: its textured parameters, evaluated. Plain data, no allocation.
struct Bsdf {
    const Material* material = nullptr;
    alignas(16) float data[16];

    /// The material's own view of `data`.
    template <class T>
    T& as() {
        static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= sizeof(data));
        return *reinterpret_cast<T*>(data);
    }
    template <class T>
    const T& as() const {
        static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= sizeof(data));
        return *reinterpret_cast<const T*>(data);
    }
};

struct BsdfSample {
    V3f wi;     ///< local frame, unit length
    Rgb weight; ///< f |cos| / pdf for smooth lobes; for delta lobes the lobe's reflectance / its probability
    float pdf;  ///< per solid angle, of all smooth lobes together; 0 for a delta lobe
    bool delta; ///< a mirror-like lobe: evalCos never sees it
    bool transmits;
    float eta = 1; ///< for transmission: relative index of refraction crossed (wi side / wo side)
};

/// BsdfSamples side by side.
struct BsdfSampleSoA {
    V3SoA wi;
    RgbSoA weight;
    alignas(64) float pdf[kSoAWidth];
    bool valid[kSoAWidth]; ///< what `sample` returns: the rest is meaningless without
    bool delta[kSoAWidth], transmits[kSoAWidth];

    void set(int i, const BsdfSample& s) {
        wi.set(i, s.wi), weight.set(i, s.weight);
        pdf[i] = s.pdf, delta[i] = s.delta, transmits[i] = s.transmits;
    }
};

/// Things to do at points of surfaces, side by side: jobs from `begin` to `end`, all at points of one
/// material.
struct BsdfQuerySoA {
    const Bsdf* bsdf;     ///< by point
    const int32_t* point; ///< by job; jobs of one point are neighbors
    const V3SoA& wo;      ///< by job: its point's
    int begin, end;
    const int32_t* active; ///< by job: what has a 0 here need not be done; null: all

    bool wants(int job) const { return !active || active[job]; }
    /// Number k of a point's Bsdf::data, in a form that loops over jobs can gather.
    float bsdfData(int32_t at, int k) const {
        static_assert(sizeof(Bsdf) % sizeof(float) == 0 && offsetof(Bsdf, data) % sizeof(float) == 0);
        constexpr int kStride = sizeof(Bsdf) / sizeof(float), kFirst = offsetof(Bsdf, data) / sizeof(float);
        return reinterpret_cast<const float*>(bsdf)[at * kStride + kFirst + k];
    }
};

/// How a material wants the normal that it is shaded with.
enum class ShadingNormal {
    AsIs,    ///< the surface's own; lobes cope with views from below its horizon
    Visible, ///< turned, where it must be, until it is seen from the geometric side that the viewer is on
    Mapped,  ///< the same, after the material's `tangentNormal` has been applied
};

/// Traits of a material that hold wherever it is.
struct MaterialFlags {
    bool smooth = true;    ///< has non-delta lobes: direct light is worth sampling
    bool diffuse = false;  ///< most of its light arrives from all around: indirect light is smooth over it
    bool textured = false; ///< a texture modulates reflection: see `Material::albedo`
    bool transmissive = false; ///< light passes through
    bool needsFootprint = false;
    bool usesLobeSample = true;      ///< `sample` reads uc
    bool usesDirectionSample = true; ///< `sample` reads u
    ShadingNormal shadingNormal = ShadingNormal::AsIs;
};

class Material {
  public:
    virtual ~Material() = default;
    const MaterialFlags& flags() const { return m_flags; }
    /// Looks textures up and fills `bsdf.data`. (The caller sets `bsdf.material`.)
    virtual void prepare(const TextureQuery& q, Bsdf& bsdf) const = 0;
    /// The same at points `begin` to `end`, to the same bits.
    virtual void prepareSoA(const TextureQuerySoA& q, int begin, int end, Bsdf* bsdf) const {
        for (int i = begin; i < end; ++i)
            prepare(q.at(i), bsdf[i]);
    }
    /// For each i: f[i] = BSDF(wo, wi[i]) * |wi[i].z| over all smooth lobes, and pdf[i] = the density per
    /// solid angle of `sample` for smooth lobes. A material of delta lobes only gives zeros. `pdf` may be
    /// null: not wanted.
    virtual void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const = 0;
    /// Draws wi. `uc` (in [0,1)) picks a lobe, `u` (in [0,1)²) a direction. False: absorbed.
    virtual bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const = 0;
    /// The same for many points at once: wi, f and pdf are by job.
    virtual void evalCosSoA(const BsdfQuerySoA& jobs, const V3SoA& wi, RgbSoA& f, float* pdf) const;
    virtual void sampleSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                           BsdfSampleSoA& out) const;
    /// As sampleSoA, for who will evaluate some of the directions only: weight and pdf of smooth lobes may
    /// be left undone, and some may be drawn whose pdf turns out to be 0.
    virtual void sampleDirectionSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                                    BsdfSampleSoA& out) const {
        sampleSoA(jobs, uc, u, out);
    }
    /// An upper bound of pdf over all wi, given wo; infinity when there is none that is easy to give.
    virtual float maxPdf(const Bsdf& bsdf, const V3f& wo) const = 0;
    virtual void maxPdfSoA(const BsdfQuerySoA& jobs, float* out) const;
    /// Of a textured material: approximately the reflectance that its texture modulates. Indirect light
    /// divided by it can be compared between neighboring points.
    virtual Rgb albedo(const Bsdf&) const { return Rgb(1); }
    /// Of a material that wants Mapped normals: the normal in the frame of dp/du, dp/dv (both made orthogonal
    /// to the surface's normal) and the normal; need not be of unit length.
    virtual V3f tangentNormal(const TextureQuery&) const { return V3f(0, 0, 1); }

  protected:
    explicit Material(const MaterialFlags& flags) : m_flags(flags) {}

  private:
    const MaterialFlags m_flags;
};

} // namespace strobe
