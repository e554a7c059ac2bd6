#include "materials/mirror.h"

#include "materials/inputs.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kKr{"Kr", Rgb(.9f), "reflectance", "reflectance", kUnlimited, kUnitRange};

struct Data {
    PlainRgb kr;
};

class Mirror : public Material {
  public:
    explicit Mirror(RgbInput kr)
        : Material({.smooth = false,
                    .needsFootprint = kr.needsFootprint(),
                    .usesLobeSample = false,
                    .usesDirectionSample = false}),
          m_kr(std::move(kr)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override {
        bsdf.as<Data>().kr = nonNegative(m_kr.at(q));
    }
    void prepareSoA(const TextureQuerySoA& q, int begin, int end, Bsdf* bsdf) const override {
        if (m_kr.texture)
            return Material::prepareSoA(q, begin, end, bsdf);
        const PlainRgb kr = nonNegative(m_kr.constant);
        for (int i = begin; i < end; ++i)
            bsdf[i].as<Data>().kr = kr;
    }
    void evalCos(const Bsdf&, const V3f&, const V3f*, int n, Rgb* f, float* pdf) const override {
        std::fill_n(f, n, Rgb(0));
        if (pdf)
            std::fill_n(pdf, n, 0.f);
    }
    bool sample(const Bsdf& bsdf, const V3f& wo, float, const V2f&, BsdfSample& out) const override {
        out = {V3f(-wo.x, -wo.y, wo.z), bsdf.as<Data>().kr, 0, true, false, 1};
        return !isBlack(out.weight);
    }
    void sampleSoA(const BsdfQuerySoA& jobs, const float*, const V2SoA&, BsdfSampleSoA& out) const override {
        for (int i = jobs.begin; i < jobs.end; ++i) {
            const PlainRgb& kr = jobs.bsdf[jobs.point[i]].as<Data>().kr;
            out.wi.x[i] = -jobs.wo.x[i];
            out.wi.y[i] = -jobs.wo.y[i];
            out.wi.z[i] = jobs.wo.z[i];
            out.weight.r[i] = kr.x;
            out.weight.g[i] = kr.y;
            out.weight.b[i] = kr.z;
            out.valid[i] = !isBlack(kr);
        }
        std::fill(out.pdf + jobs.begin, out.pdf + jobs.end, 0.f);
        std::fill(out.delta + jobs.begin, out.delta + jobs.end, true);
        std::fill(out.transmits + jobs.begin, out.transmits + jobs.end, false);
    }
    float maxPdf(const Bsdf&, const V3f&) const override { return 0; }
    void maxPdfSoA(const BsdfQuerySoA& jobs, float* out) const override {
        std::fill(out + jobs.begin, out + jobs.end, 0.f);
    }

  private:
    RgbInput m_kr;
};

} // namespace

Plugin<std::shared_ptr<const Material>> mirrorPlugin() {
    return {"mirror",
            "perfect mirror of constant reflectance",
            {kKr},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const Mirror>(params.get(kKr));
            }};
}

} // namespace strobe
