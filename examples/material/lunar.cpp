// A material of dusty surfaces, such as the Moon's: single scattering in a medium without boundary
// (Lommel-Seeliger).
#include <strobe/plugin.h>

namespace strobe {

namespace {

const ParamDef<RgbInput> kAlbedo{"albedo", Rgb(.5f), "albedo of a grain of dust, 0 to 1"};

/// The values of the parameters at a surface point.
struct Data {
    PlainRgb albedo;
};

/// The BRDF albedo / (4π (cosθi + cosθo)). Samples follow the cosine.
class Lunar : public Material {
  public:
    explicit Lunar(RgbInput albedo)
        : Material({.diffuse = true,
                    .textured = albedo.texture != nullptr,
                    .needsFootprint = albedo.needsFootprint(),
                    .usesLobeSample = false}),
          m_albedo(std::move(albedo)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        bsdf.as<Data>() = {nonNegative(m_albedo.at(q))};
    }

    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        for (int i = 0; i < n; ++i) {
            f[i] = bsdf.as<Data>().albedo * valueCos(wo, wi[i]);
            if (pdf)
                pdf[i] = wo.z * wi[i].z > 0 ? cosineHemispherePdf(std::abs(wi[i].z)) : 0;
        }
    }

    bool sample(const Bsdf& bsdf, const V3f& wo, float, const V2f& u, BsdfSample& out) const override {
        out.wi = cosineHemisphere(u);
        out.pdf = cosineHemispherePdf(out.wi.z);
        if (!(out.pdf > 0))
            return false;
        out.wi.z = std::copysign(out.wi.z, wo.z);
        out.weight = bsdf.as<Data>().albedo * (valueCos(wo, out.wi) / out.pdf);
        out.delta = out.transmits = false;
        out.eta = 1;
        return true;
    }

    float maxPdf(const Bsdf&, const V3f&) const override { return kInvPi; }

    Rgb albedo(const Bsdf& bsdf) const override { return bsdf.as<Data>().albedo; }

  private:
    /// Returns the BRDF, without the albedo, times |cosθi|.
    static float valueCos(const V3f& wo, const V3f& wi) {
        const float cosI = std::abs(wi.z), cosO = std::abs(wo.z);
        return cosI > 0 ? kInvPi / 4 * cosI / (cosI + cosO) : 0;
    }

    const RgbInput m_albedo;
};

} // namespace

MaterialPlugin lunarPlugin() {
    return {"lunar",
            "dust, as on the Moon: as bright at the rim as in the middle when lit from behind the viewer",
            {kAlbedo},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const Lunar>(params.get(kAlbedo));
            }};
}

} // namespace strobe

STROBE_PLUGIN_LIBRARY([](strobe::PluginRows& rows) { rows.add(strobe::lunarPlugin()); })
