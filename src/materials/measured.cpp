#include "materials/measured.h"

#include "core/sampling.h"
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

/// A BRDF of any table, sampled by the cosine. Negative interpolated values (spectra outside the gamut of
/// RGB) count as zero, as in pbrt-v2.
template <class Table>
class Measured : public Material {
  public:
    explicit Measured(Table table) : m_table(std::move(table)) {}

    void prepare(const TextureQuery&, Bsdf&) const override {}

    void evalCos(const Bsdf&, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        const float side = wo.z < 0 ? -1.f : 1.f;
        for (int i = 0; i < n; ++i) {
            f[i] = value(wo, wi[i]) * std::abs(wi[i].z);
            pdf[i] = cosineHemispherePdf(side * wi[i].z);
        }
    }
    bool sample(const Bsdf&, const V3f& wo, float, const V2f& u, BsdfSample& out) const override {
        V3f wi = cosineHemisphere(u);
        out.pdf = cosineHemispherePdf(wi.z);
        if (!(out.pdf > 0))
            return false;
        if (wo.z < 0)
            wi.z = -wi.z;
        out.wi = wi;
        out.weight = value(wo, wi) * kPi;
        out.delta = out.transmits = false;
        out.eta = 1;
        return true;
    }
    float maxPdf(const Bsdf&, const V3f&) const override { return kInvPi; }
    bool isSmooth() const override { return true; }

  private:
    Rgb value(const V3f& wo, const V3f& wi) const { return nonNegative(m_table(wo, wi)); }
    Table m_table;
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
