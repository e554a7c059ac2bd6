// The interface of materials. A Material evaluates its textures at a surface point once, which gives a Bsdf,
// and then evaluates and samples this Bsdf.
//
// Directions are unit vectors in the local shading frame, whose z axis is the shading normal of the surface.
// The normal is not flipped towards the viewer. wo and wi both point away from the surface. wo is the
// direction to the viewer (towards the previous path vertex), wi the direction from which light arrives.
//
// wo.z may be negative: the viewer may be on the inside. Reflection lobes are two-sided and treat (wo, wi)
// and
// (-wo, -wi) alike; pbrt-v3's plastic is the exception. Transmissive materials derive the side from the sign
// of wo.z; positive means outside.
//
// The caller decides by the geometric normals whether a pair of directions is a reflection or a transmission.
// So evalCos uses the absolute values of both cosines and does not test hemispheres, as in pbrt-v2: a lobe
// may be evaluated slightly below the shading horizon. In contrast, `pdf` is the density of the directions
// that `sample` generates, so it is zero for directions that `sample` cannot generate.
#pragma once

#include "core/interfaces/texture.h"
#include "core/math/api.h"
#include "core/math/soa.h"

#include <cstddef>
#include <type_traits>

namespace STROBE_API strobe {

class Material;

/// The values of a material's parameters at a surface point.
struct Bsdf {
    const Material* material = nullptr;
    alignas(16) float data[32]; ///< defined by the material

    /// Returns `data` as the material's own, trivially copyable type.
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

/// A direction sampled from a BSDF.
struct BsdfSample {
    V3f wi;
    /// For smooth lobes, f |cos θi| / pdf; for delta lobes, reflectance / probability of the lobe.
    Rgb weight;
    float pdf;      ///< per solid angle, of all smooth lobes together; 0 for a delta lobe
    bool delta;     ///< sampled from a delta lobe
    bool transmits; ///< wi is on the other side of the surface than wo
    float eta = 1;  ///< if `transmits`: index of refraction on the side of wi / index on the side of wo
};

/// BSDF samples as a structure of arrays, without eta.
struct BsdfSampleSoA {
    V3SoA wi;
    RgbSoA weight;
    alignas(64) float pdf[kSoAWidth];
    bool valid[kSoAWidth]; ///< result of `sample`; if false, the other members are undefined
    bool delta[kSoAWidth], transmits[kSoAWidth];

    void set(int i, const BsdfSample& s) {
        wi.set(i, s.wi);
        weight.set(i, s.weight);
        pdf[i] = s.pdf;
        delta[i] = s.delta;
        transmits[i] = s.transmits;
    }
};

/// The arguments of the SoA functions of Material: evaluations begin … end-1, all at points of one material.
/// Several evaluations may refer to the same point; these are neighbors.
struct BsdfQuerySoA {
    const Bsdf* bsdf;     ///< by point
    const int32_t* point; ///< by evaluation: index of its point
    const V3SoA& wo;      ///< by evaluation; equal for evaluations of the same point
    int begin, end;       ///< 0 <= begin <= end <= kSoAWidth
    const int32_t*
        active; ///< by evaluation: 0 if the result is not used, and then undefined; null: all are active

    bool isActive(int i) const { return !active || active[i]; }
    /// Returns bsdf[point].data[k], in a form that vectorizes to gathers.
    float bsdfData(int32_t pointIndex, int k) const {
        static_assert(sizeof(Bsdf) % sizeof(float) == 0 && offsetof(Bsdf, data) % sizeof(float) == 0);
        constexpr int kStride = sizeof(Bsdf) / sizeof(float), kFirst = offsetof(Bsdf, data) / sizeof(float);
        return reinterpret_cast<const float*>(bsdf)[pointIndex * kStride + kFirst + k];
    }
};

/// The shading normal that a material requires.
enum class ShadingNormal {
    /// The interpolated normal of the surface. wo may lie below its horizon.
    AsIs,
    /// The interpolated normal, bent if necessary such that wo is on the same side of the shading and the
    /// geometric surface.
    Visible,
    /// The normal of Material::mappedNormal, bent as for Visible, and such that the mirror direction of wo
    /// lies above the geometric surface: else dark crescents appear where reflections would be lost.
    Mapped,
};

/// The frame of normal maps and bump maps at a surface point, in world space.
struct TangentFrame {
    V3f dpdu, dpdv;        ///< see Scene::tangents; zero where texture coordinates are degenerate
    V3f n;                 ///< unit interpolated normal, on the outer side of the surface
    bool hasVertexNormals; ///< `n` is interpolated from the vertices of a mesh
};

/// The properties of a material that do not depend on the surface point.
struct MaterialFlags {
    bool smooth = true;         ///< has lobes that are not delta lobes, so that lights are sampled
    bool delta = false;         ///< has delta lobes beside others, such as the gloss of varnish
    bool diffuse = false;       ///< mostly diffuse, so that its indirect light varies slowly over the surface
    bool textured = false;      ///< a texture modulates the reflection; see albedo, reflectance
    bool viewDependent = false; ///< the reflectance varies much with wo; see reflectance
    bool transmissive = false;  ///< has transmissive lobes
    bool isMix = false;         ///< stands for another material at each point; see Material::chosen
    bool needsFootprint = false;     ///< reads the footprint of TextureQuery
    bool needsTangents = false;      ///< anisotropic: the x axis of the shading frame must lie along dp/du
    bool usesLobeSample = true;      ///< `sample` reads uc
    bool usesDirectionSample = true; ///< `sample` reads u
    ShadingNormal shadingNormal = ShadingNormal::AsIs;
};

/// Interface of materials. Materials are immutable, and all functions are thread-safe. The default SoA
/// functions call the scalar functions; overrides must return the same bits.
class Material {
  public:
    virtual ~Material() = default;
    const MaterialFlags& flags() const { return m_flags; }

    /// Returns the material that stands for a mix at a surface point; for all others, the material itself. To
    /// be called before all other functions of a mix.
    virtual const Material& chosen(const TextureQuery&) const { return *this; }
    /// Evaluates the textures at a surface point and writes bsdf.data. The caller sets bsdf.material.
    virtual void prepare(const TextureQuery& q, Bsdf& bsdf) const = 0;
    /// Prepares points begin … end-1; same results as `prepare`, to the bit.
    virtual void prepareSoA(const TextureQuerySoA& q, int begin, int end, Bsdf* bsdf) const {
        for (int i = begin; i < end; ++i)
            prepare(q.at(i), bsdf[i]);
    }

    /// Evaluates the sum of all smooth lobes for n directions wi: f[i] = f(wo, wi[i]) |cos θi|, and pdf[i] is
    /// the density per solid angle with which `sample` generates wi[i] from smooth lobes. `pdf` may be null.
    /// Delta lobes contribute zero.
    virtual void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const = 0;
    /// Evaluates pairs of directions; same results as evalCos, to the bit. wi, f and pdf are indexed by
    /// evaluation.
    virtual void evalCosSoA(const BsdfQuerySoA& query, const V3SoA& wi, RgbSoA& f, float* pdf) const;

    /// Samples wi: `uc` in [0,1) selects a lobe, `u` in [0,1)² a direction. Returns false if there is no
    /// sample: the path is absorbed, and `out` is undefined.
    virtual bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const = 0;
    /// Samples directions; same results as `sample`, to the bit.
    virtual void sampleSoA(const BsdfQuerySoA& query, const float* uc, const V2SoA& u,
                           BsdfSampleSoA& out) const;
    /// Samples the same directions as sampleSoA, for callers that then evaluate only some of them with
    /// evalCosSoA: the weight and pdf of smooth lobes may be undefined, and `valid` may be true for samples
    /// whose pdf is 0. The default calls sampleSoA.
    virtual void sampleDirectionSoA(const BsdfQuerySoA& query, const float* uc, const V2SoA& u,
                                    BsdfSampleSoA& out) const {
        sampleSoA(query, uc, u, out);
    }

    /// Returns an upper bound of `pdf` in evalCos over all wi; infinity if no simple bound is known.
    virtual float maxPdf(const Bsdf& bsdf, const V3f& wo) const = 0;
    /// Returns the bounds for several wo; same results as maxPdf, to the bit.
    virtual void maxPdfSoA(const BsdfQuerySoA& query, float* out) const;

    /// Returns whether all lobes of a point are around the mirrored or the refracted direction, as those of
    /// metal and glass. The default is no.
    virtual bool isSpecular(const Bsdf&) const { return false; }

    /// Returns the approximate reflectance that the texture of a textured material modulates. Indirect light
    /// divided by the albedo is shared between neighboring points. The default is white.
    virtual Rgb albedo(const Bsdf&) const { return Rgb(1); }
    /// Returns the approximate fraction of uniform light that a textured or view-dependent material reflects
    /// towards wo (the second argument), up to a constant factor; positive unless the material is black.
    /// adaptive-cache divides light by it. The default is the albedo.
    virtual Rgb reflectance(const Bsdf& bsdf, const V3f&) const { return albedo(bsdf); }
    /// For ShadingNormal::Mapped: returns the shading normal in world space, of any length. The default is
    /// the interpolated normal.
    virtual V3f mappedNormal(const TextureQuery&, const TangentFrame& frame) const { return frame.n; }

  protected:
    explicit Material(const MaterialFlags& flags) : m_flags(flags) {}

  private:
    const MaterialFlags m_flags;
};

} // namespace strobe
