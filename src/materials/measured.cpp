#include "materials/measured.h"

#include "core/math/sampling.h"
#include "materials/gloss_fit.h"
#include "materials/inputs.h"
#include "materials/irregular_brdf.h"
#include "materials/lobe_soa.h"
#include "materials/merl_brdf.h"
#include "materials/microfacet.h"

namespace strobe {
namespace {

const ParamDef<FilePath> kFilename{
    "filename", {}, "file of measurements: pbrt-v2's text format (.brdf) or MERL (.binary, .merl)"};

// Tables of values: operator() evaluates a pair of directions; evalSoA evaluates the pairs of jobs, and gives
// black where `mask` is 0 (a null mask selects all).

struct IrregularTable {
    IrregularBrdf brdf;
    Rgb operator()(const V3f& wo, const V3f& wi) const { return brdf.eval(IrregularBrdf::keyOf(wo, wi)); }
    void evalSoA(const BsdfQuerySoA& jobs, const V3SoA& wi, const int32_t* mask, RgbSoA& out) const {
        V3SoA keys;
        IrregularBrdf::keySoA(jobs.wo, wi, jobs.begin, jobs.end, keys);
        brdf.evalSoA(keys, mask, jobs.begin, jobs.end, out);
    }
};
struct MerlTable {
    MerlBrdf brdf;
    Rgb operator()(const V3f& wo, const V3f& wi) const { return brdf.eval(wo, wi); }
    void evalSoA(const BsdfQuerySoA& jobs, const V3SoA& wi, const int32_t* mask, RgbSoA& out) const {
        for (int i = jobs.begin; i < jobs.end; ++i)
            out.set(i, !mask || mask[i] ? brdf.eval(jobs.wo.at(i), wi.at(i)) : Rgb(0));
    }
};

/// The sampling density for one wo: a mixture of the cosine and a GGX lobe.
struct Mixture {
    float lobeProbability;
    float side; ///< sign of wi.z
    GgxReflection lobe;

    STROBE_FORCE_INLINE Mixture(const GlossFit::Lobe& fit, const V3f& wo)
        : lobeProbability(fit.probability), side(wo.z < 0 ? -1.f : 1.f), lobe(wo, fit.alpha) {}
    STROBE_FORCE_INLINE float pdf(const V3f& wo, const V3f& wi) const {
        const float cosI = side * wi.z;
        return cosI > 0 ? lerp(cosineHemispherePdf(cosI), lobe.pdf(wo, wi), lobeProbability) : 0;
    }
    STROBE_FORCE_INLINE int32_t sampleDirection(const V3f& wo, float uc, const V2f& u, V3f& wi) const {
        V3f glossy;
        const int32_t above = lobe.sample(wo, u, glossy);
        const bool isGloss = uc < lobeProbability;
        const V3f diffuse = cosineHemisphere(u);
        wi.x = isGloss ? glossy.x : diffuse.x;
        wi.y = isGloss ? glossy.y : diffuse.y;
        wi.z = isGloss ? glossy.z : diffuse.z * side;
        return isGloss ? above : 1;
    }
};

/// The mixture of each job.
struct MixtureSoA {
    const GlossFit& fit;
    const V3SoA& wo;
    STROBE_FORCE_INLINE Mixture at(int job) const { return {fit.at(wo.z[job]), wo.at(job)}; }
};

STROBE_TARGET_CLONES void mixturePdfSoA(const MixtureSoA& mixtures, int begin, int end, const V3SoA& wi,
                                        float* pdf) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i)
        pdf[i] = mixtures.at(i).pdf(mixtures.wo.at(i), wi.at(i));
}

/// Returns an upper bound of the density of the mixture over all wi.
STROBE_FORCE_INLINE float maxMixturePdf(const GlossFit& fit, const V3f& wo) {
    const GlossFit::Lobe lobe = fit.at(wo.z);
    return lerp(kInvPi, GgxReflection::maxPdf(wo, lobe.alpha), lobe.probability);
}
STROBE_TARGET_CLONES void maxMixturePdfSoA(const GlossFit& fit, const V3SoA& wo, int begin, int end,
                                           float* out) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i)
        out[i] = maxMixturePdf(fit, wo.at(i));
}

/// Replaces each value f by max(f, 0) |cos wi|.
STROBE_TARGET_CLONES void clampAndScaleByCosine(int begin, int end, const V3SoA& wi, RgbSoA& f) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const float cosine = std::abs(wi.z[i]);
        f.r[i] = std::max(f.r[i], 0.f) * cosine;
        f.g[i] = std::max(f.g[i], 0.f) * cosine;
        f.b[i] = std::max(f.b[i], 0.f) * cosine;
    }
}

/// The BRDF of a table. Negative values (of spectra outside the gamut of RGB) count as zero, as in pbrt-v2.
template <class Table>
class Measured : public Material {
  public:
    explicit Measured(Table table)
        : Material({.viewDependent = true}), m_table(std::move(table)),
          m_fit([this](const V3f& wo, const V3f& wi) { return luminance(nonNegative(m_table(wo, wi))); }) {}

    void prepare(const TextureQuery&, Bsdf&) const override {}

    void evalCos(const Bsdf&, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        for (int i = 0; i < n; ++i)
            f[i] = value(wo, wi[i]);
        if (!pdf)
            return;
        const Mixture mixture(m_fit.at(wo.z), wo);
        for (int i = 0; i < n; ++i)
            pdf[i] = mixture.pdf(wo, wi[i]);
    }
    void evalCosSoA(const BsdfQuerySoA& jobs, const V3SoA& wi, RgbSoA& f, float* pdf) const override {
        valueSoA(jobs, wi, jobs.active, f);
        if (pdf)
            mixturePdfSoA({m_fit, jobs.wo}, jobs.begin, jobs.end, wi, pdf);
    }
    bool sample(const Bsdf&, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const override {
        const Mixture mixture(m_fit.at(wo.z), wo);
        if (!mixture.sampleDirection(wo, uc, u, out.wi))
            return false;
        out.pdf = mixture.pdf(wo, out.wi);
        if (!(out.pdf > 0))
            return false;
        out.weight = value(wo, out.wi) * (1 / out.pdf);
        out.delta = false;
        out.transmits = false;
        out.eta = 1;
        return true;
    }
    void sampleSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                   BsdfSampleSoA& out) const override {
        alignas(64) int32_t drawn[kSoAWidth];
        sampleLobes(MixtureSoA{m_fit, jobs.wo}, jobs, uc, u, out.wi, drawn);
        mixturePdfSoA({m_fit, jobs.wo}, jobs.begin, jobs.end, out.wi, out.pdf);
        valueSoA(jobs, out.wi, drawn, out.weight);
        finishSamples(jobs, drawn, out);
    }
    void sampleDirectionSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                            BsdfSampleSoA& out) const override {
        alignas(64) int32_t drawn[kSoAWidth];
        sampleLobes(MixtureSoA{m_fit, jobs.wo}, jobs, uc, u, out.wi, drawn);
        finishDirections(jobs, drawn, out);
    }
    float maxPdf(const Bsdf&, const V3f& wo) const override { return maxMixturePdf(m_fit, wo); }
    Rgb reflectance(const Bsdf&, const V3f& wo) const override { return Rgb(m_fit.reflectance(wo.z)); }
    void maxPdfSoA(const BsdfQuerySoA& jobs, float* out) const override {
        maxMixturePdfSoA(m_fit, jobs.wo, jobs.begin, jobs.end, out);
    }

  private:
    Rgb value(const V3f& wo, const V3f& wi) const { return nonNegative(m_table(wo, wi)) * std::abs(wi.z); }
    void valueSoA(const BsdfQuerySoA& jobs, const V3SoA& wi, const int32_t* mask, RgbSoA& f) const {
        m_table.evalSoA(jobs, wi, mask, f);
        clampAndScaleByCosine(jobs.begin, jobs.end, wi, f);
    }

    Table m_table;
    GlossFit m_fit; ///< must follow m_table, to which it is fitted
};

std::shared_ptr<const Material> create(const ParamSet& params, const BuildContext&) {
    const std::filesystem::path path = params.require(kFilename).path;
    const Location where = params.whereIs(kFilename);
    const std::string extension = path.extension().string();
    if (extension == ".brdf" || extension == ".BRDF")
        return std::make_shared<const Measured<IrregularTable>>(
            IrregularTable{IrregularBrdf(readIrregularBrdf(path, where))});
    if (extension == ".binary" || extension == ".merl")
        return std::make_shared<const Measured<MerlTable>>(MerlTable{MerlBrdf(path, where)});
    throw Error(where, "unknown extension \"" + extension +
                           "\" of a measured BRDF (known: .brdf for pbrt-v2's text format, .binary and "
                           ".merl for MERL)");
}

} // namespace

Plugin<std::shared_ptr<const Material>> measuredPlugin() {
    return {"measured", "isotropic BRDF from a file of measurements (pbrt-v2 or MERL)", {kFilename}, create};
}

} // namespace strobe
