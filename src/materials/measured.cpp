#include "materials/measured.h"

#include "core/sampling.h"
#include "materials/ggx.h"
#include "materials/gloss_fit.h"
#include "materials/inputs.h"
#include "materials/irregular_brdf.h"
#include "materials/merl_brdf.h"

namespace strobe {
namespace {

const ParamDef<FilePath> kFilename{"filename", {}, ".brdf text (pbrt-v2) or MERL .binary file"};

/// pbrt-v2's scattered samples, looked up by the key of the pair of directions.
struct Scattered {
    IrregularBrdf brdf;
    Rgb operator()(const V3f& wo, const V3f& wi) const { return brdf.eval(IrregularBrdf::keyOf(wo, wi)); }
};
struct Regular {
    MerlBrdf brdf;
    Rgb operator()(const V3f& wo, const V3f& wi) const { return brdf.eval(wo, wi); }
};

/// The density of `sample`, given wo.
struct Mixture {
    float share; ///< of the lobe
    float side;  ///< the sign of wi.z
    GgxReflection lobe;

    Mixture(const GlossFit& fit, const V3f& wo) : Mixture(fit.at(wo.z), wo) {}
    float pdf(const V3f& wo, const V3f& wi) const {
        const float cosI = side * wi.z;
        return cosI > 0 ? lerp(cosineHemispherePdf(cosI), lobe.pdf(wo, wi), share) : 0;
    }

  private:
    Mixture(const GlossFit::Lobe& fit, const V3f& wo)
        : share(fit.share), side(wo.z < 0 ? -1.f : 1.f), lobe(wo, fit.alpha) {}
};

/// A BRDF of any table, sampled by the mixture of the cosine and a GGX lobe that fits it. Negative
/// interpolated values (spectra outside the gamut of RGB) count as zero, as in pbrt-v2.
template <class Table>
class Measured : public Material {
  public:
    explicit Measured(Table table)
        : m_table(std::move(table)),
          m_fit([this](const V3f& wo, const V3f& wi) { return luminance(value(wo, wi)); }) {}

    void prepare(const TextureQuery&, Bsdf&) const override {}

    void evalCos(const Bsdf&, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        for (int i = 0; i < n; ++i)
            f[i] = value(wo, wi[i]) * std::abs(wi[i].z);
        if (!pdf)
            return;
        const Mixture mixture(m_fit, wo);
        for (int i = 0; i < n; ++i)
            pdf[i] = mixture.pdf(wo, wi[i]);
    }
    bool sample(const Bsdf&, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const override {
        const Mixture mixture(m_fit, wo);
        if (uc < mixture.share) {
            if (!mixture.lobe.sample(wo, u, out.wi))
                return false;
        } else {
            out.wi = cosineHemisphere(u);
            out.wi.z *= mixture.side;
        }
        out.pdf = mixture.pdf(wo, out.wi);
        if (!(out.pdf > 0))
            return false;
        out.weight = value(wo, out.wi) * (std::abs(out.wi.z) / out.pdf);
        out.delta = out.transmits = false;
        out.eta = 1;
        return true;
    }
    float maxPdf(const Bsdf&, const V3f& wo) const override {
        const GlossFit::Lobe fit = m_fit.at(wo.z);
        return lerp(kInvPi, GgxReflection::maxPdf(wo, fit.alpha), fit.share);
    }
    bool isSmooth() const override { return true; }

  private:
    Rgb value(const V3f& wo, const V3f& wi) const { return nonNegative(m_table(wo, wi)); }

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
