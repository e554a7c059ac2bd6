#include "materials/measured.h"

#include "core/math/sampling.h"
#include "materials/ggx.h"
#include "materials/gloss_fit.h"
#include "materials/inputs.h"
#include "materials/irregular_brdf.h"
#include "materials/lobe_lanes.h"
#include "materials/merl_brdf.h"

namespace strobe {
namespace {

const ParamDef<FilePath> kFilename{"filename", {}, ".brdf text (pbrt-v2) or MERL .binary file"};

/// pbrt-v2's scattered samples, looked up by the key of the pair of directions.
struct Scattered {
    IrregularBrdf brdf;
    Rgb operator()(const V3f& wo, const V3f& wi) const { return brdf.eval(IrregularBrdf::keyOf(wo, wi)); }
    void lanes(const BsdfQuerySoA& jobs, const V3SoA& wi, const int32_t* wanted, RgbSoA& out) const {
        V3SoA keys;
        IrregularBrdf::keySoA(jobs.wo, wi, jobs.begin, jobs.end, keys);
        brdf.evalSoA(keys, wanted, jobs.begin, jobs.end, out);
    }
};
struct Regular {
    MerlBrdf brdf;
    Rgb operator()(const V3f& wo, const V3f& wi) const { return brdf.eval(wo, wi); }
    void lanes(const BsdfQuerySoA& jobs, const V3SoA& wi, const int32_t* wanted, RgbSoA& out) const {
        for (int i = jobs.begin; i < jobs.end; ++i)
            out.set(i, !wanted || wanted[i] ? brdf.eval(jobs.wo.at(i), wi.at(i)) : Rgb(0));
    }
};

/// The directions that `sample` draws, given wo.
struct Mixture {
    float share; ///< of the lobe
    float side;  ///< the sign of wi.z
    GgxReflection lobe;

    STROBE_FORCE_INLINE Mixture(const GlossFit::Lobe& fit, const V3f& wo)
        : share(fit.share), side(wo.z < 0 ? -1.f : 1.f), lobe(wo, fit.alpha) {}
    STROBE_FORCE_INLINE float pdf(const V3f& wo, const V3f& wi) const {
        const float cosI = side * wi.z;
        return cosI > 0 ? lerp(cosineHemispherePdf(cosI), lobe.pdf(wo, wi), share) : 0;
    }
    STROBE_FORCE_INLINE int32_t draw(const V3f& wo, float uc, const V2f& u, V3f& wi) const {
        V3f glossy;
        const int32_t above = lobe.draw(wo, u, glossy);
        const bool isGloss = uc < share;
        const V3f any = cosineHemisphere(u);
        wi.x = isGloss ? glossy.x : any.x;
        wi.y = isGloss ? glossy.y : any.y;
        wi.z = isGloss ? glossy.z : any.z * side;
        return isGloss ? above : 1;
    }
};

struct MixtureSoA {
    const GlossFit& fit;
    const V3SoA& wo;
    STROBE_FORCE_INLINE Mixture at(int job) const { return {fit.at(wo.z[job]), wo.at(job)}; }
};

STROBE_TARGET_CLONES void pdfsOfMixtures(const MixtureSoA& lobes, int begin, int end, const V3SoA& wi,
                                         float* pdf) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i)
        pdf[i] = lobes.at(i).pdf(lobes.wo.at(i), wi.at(i));
}

STROBE_FORCE_INLINE float boundPdf(const GlossFit& fit, const V3f& wo) {
    const GlossFit::Lobe lobe = fit.at(wo.z);
    return lerp(kInvPi, GgxReflection::maxPdf(wo, lobe.alpha), lobe.share);
}
STROBE_TARGET_CLONES void boundsOfMixtures(const GlossFit& fit, const V3SoA& wo, int begin, int end,
                                           float* out) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i)
        out[i] = boundPdf(fit, wo.at(i));
}

/// Negative values count as zero; times the cosine.
STROBE_TARGET_CLONES void shadeValues(int begin, int end, const V3SoA& wi, RgbSoA& f) {
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const float cosine = std::abs(wi.z[i]);
        f.r[i] = std::max(f.r[i], 0.f) * cosine;
        f.g[i] = std::max(f.g[i], 0.f) * cosine;
        f.b[i] = std::max(f.b[i], 0.f) * cosine;
    }
}

/// A BRDF of any table, sampled by the mixture of the cosine and a GGX lobe that fits it. Negative
/// interpolated values (spectra outside the gamut of RGB) count as zero, as in pbrt-v2.
template <class Table>
class Measured : public Material {
  public:
    explicit Measured(Table table)
        : Material({}), m_table(std::move(table)),
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
            pdfsOfMixtures({m_fit, jobs.wo}, jobs.begin, jobs.end, wi, pdf);
    }
    bool sample(const Bsdf&, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const override {
        const Mixture mixture(m_fit.at(wo.z), wo);
        if (!mixture.draw(wo, uc, u, out.wi))
            return false;
        out.pdf = mixture.pdf(wo, out.wi);
        if (!(out.pdf > 0))
            return false;
        out.weight = value(wo, out.wi) * (1 / out.pdf);
        out.delta = out.transmits = false;
        out.eta = 1;
        return true;
    }
    void sampleSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                   BsdfSampleSoA& out) const override {
        alignas(64) int32_t drawn[kSoAWidth];
        drawLobes(MixtureSoA{m_fit, jobs.wo}, jobs, uc, u, out.wi, drawn);
        pdfsOfMixtures({m_fit, jobs.wo}, jobs.begin, jobs.end, out.wi, out.pdf);
        valueSoA(jobs, out.wi, drawn, out.weight);
        finishSamples(jobs, drawn, out);
    }
    void sampleDirectionSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                            BsdfSampleSoA& out) const override {
        alignas(64) int32_t drawn[kSoAWidth];
        drawLobes(MixtureSoA{m_fit, jobs.wo}, jobs, uc, u, out.wi, drawn);
        finishDirections(jobs, drawn, out);
    }
    float maxPdf(const Bsdf&, const V3f& wo) const override { return boundPdf(m_fit, wo); }
    void maxPdfSoA(const BsdfQuerySoA& jobs, float* out) const override {
        boundsOfMixtures(m_fit, jobs.wo, jobs.begin, jobs.end, out);
    }

  private:
    Rgb value(const V3f& wo, const V3f& wi) const { return nonNegative(m_table(wo, wi)) * std::abs(wi.z); }
    void valueSoA(const BsdfQuerySoA& jobs, const V3SoA& wi, const int32_t* wanted, RgbSoA& f) const {
        m_table.lanes(jobs, wi, wanted, f);
        shadeValues(jobs.begin, jobs.end, wi, f);
    }

    Table m_table;
    GlossFit m_fit; ///< of m_table: after it
};

std::shared_ptr<const Material> create(const ParamSet& params, const BuildContext&) {
    const std::filesystem::path path = params.require(kFilename).path;
    const Location where = params.whereIs(kFilename);
    const std::string extension = path.extension().string();
    if (extension == ".brdf" || extension == ".BRDF")
        return std::make_shared<const Measured<Scattered>>(
            Scattered{IrregularBrdf(readIrregularBrdf(path, where))});
    if (extension == ".binary" || extension == ".merl")
        return std::make_shared<const Measured<Regular>>(Regular{MerlBrdf(path, where)});
    throw Error(where, "cannot tell the kind of measured BRDF from the extension \"" + extension +
                           "\" (known: .brdf for pbrt-v2's text, .binary or .merl for MERL)");
}

} // namespace

Plugin<std::shared_ptr<const Material>> measuredPlugin() {
    return {"measured", "isotropic BRDF from a file of measurements", {kFilename}, create};
}

} // namespace strobe
