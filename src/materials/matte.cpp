#include "materials/matte.h"

#include "core/math/sampling.h"
#include "materials/inputs.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kKd{"Kd", Rgb(.5f), "diffuse reflectance", "reflectance", kUnlimited, kUnitRange};
const ParamDef<FloatInput> kSigma{
    "sigma", 0.f,
    "standard deviation of the slope angle of the facets (Oren-Nayar), in degrees; 0: Lambertian"};

/// f = Kd/π (A + B max(0, cos(φi-φo)) sinα tanβ). The Lambertian BRDF has A = 1, B = 0.
struct Data {
    PlainRgb scaledKd; ///< Kd/π
    float a, b;
};
/// The Data of each job's point. `kUniform`: all points of the material have the same Data.
template <bool kUniform>
struct MatteSoA {
    const BsdfQuerySoA& jobs;
    const Data first = atPoint(jobs.point[jobs.begin]);

    Data atPoint(int32_t point) const {
        return {Rgb(jobs.bsdfData(point, 0), jobs.bsdfData(point, 1), jobs.bsdfData(point, 2)),
                jobs.bsdfData(point, 3), jobs.bsdfData(point, 4)};
    }
    Data at(int job) const { return kUniform ? first : atPoint(jobs.point[job]); }
};

/// Returns A + B max(0, cos(φi-φo)) sinα tanβ, where sinα tanβ = sinθi sinθo / max(cosθi, cosθo): the product
/// with cos(φi-φo) is a dot product of the horizontal components (Oren & Nayar 1994).
inline float brightness(const Data& data, const V3f& wo, const V3f& wi) {
    const float horizontal = std::max(0.f, wo.x * wi.x + wo.y * wi.y);
    return data.a + data.b * horizontal / std::max(std::max(std::abs(wo.z), std::abs(wi.z)), 1e-6f);
}
inline float pdfMatte(const V3f& wo, const V3f& wi) {
    return cosineHemispherePdf(std::copysign(1.f, wo.z) * wi.z);
}
inline V3f sampleDirection(const V3f& wo, const V2f& u) {
    const V3f w = cosineHemisphere(u);
    return {w.x, w.y, std::copysign(w.z, wo.z)};
}

template <bool kUniform>
inline void evalAll(const BsdfQuerySoA& jobs, const V3SoA& wi, RgbSoA& f) {
    const MatteSoA<kUniform> points{jobs};
    STROBE_IVDEP
    for (int i = jobs.begin; i < jobs.end; ++i) {
        const Data data = points.at(i);
        const float shade = brightness(data, jobs.wo.at(i), wi.at(i)) * std::abs(wi.z[i]);
        f.r[i] = data.scaledKd.x * shade;
        f.g[i] = data.scaledKd.y * shade;
        f.b[i] = data.scaledKd.z * shade;
    }
}

template <bool kUniform>
inline void sampleAll(const BsdfQuerySoA& jobs, const V2SoA& u, BsdfSampleSoA& out) {
    const MatteSoA<kUniform> points{jobs};
    STROBE_IVDEP
    for (int i = jobs.begin; i < jobs.end; ++i) {
        const Data data = points.at(i);
        const V3f wo = jobs.wo.at(i), wi = sampleDirection(wo, u.at(i));
        const float shade = kPi * brightness(data, wo, wi);
        out.wi.x[i] = wi.x;
        out.wi.y[i] = wi.y;
        out.wi.z[i] = wi.z;
        out.pdf[i] = pdfMatte(wo, wi);
        out.weight.r[i] = data.scaledKd.x * shade;
        out.weight.g[i] = data.scaledKd.y * shade;
        out.weight.b[i] = data.scaledKd.z * shade;
    }
}

STROBE_TARGET_CLONES void evalMatte(bool isUniform, const BsdfQuerySoA& jobs, const V3SoA& wi, RgbSoA& f) {
    isUniform ? evalAll<true>(jobs, wi, f) : evalAll<false>(jobs, wi, f);
}
STROBE_TARGET_CLONES void pdfMatteSoA(const BsdfQuerySoA& jobs, const V3SoA& wi, float* pdf) {
    STROBE_IVDEP
    for (int i = jobs.begin; i < jobs.end; ++i)
        pdf[i] = pdfMatte(jobs.wo.at(i), wi.at(i));
}
STROBE_TARGET_CLONES void sampleMatte(bool isUniform, const BsdfQuerySoA& jobs, const V2SoA& u,
                                      BsdfSampleSoA& out) {
    isUniform ? sampleAll<true>(jobs, u, out) : sampleAll<false>(jobs, u, out);
}

class Matte : public Material {
  public:
    Matte(RgbInput kd, FloatInput sigma)
        : Material({.diffuse = true,
                    .textured = kd.texture != nullptr,
                    .needsFootprint = kd.needsFootprint() || sigma.needsFootprint(),
                    .usesLobeSample = false}),
          m_kd(std::move(kd)), m_sigma(std::move(sigma)) {}

    void prepare(const TextureQuery& q, Bsdf& bsdf) const override { fill(m_kd.at(q), m_sigma.at(q), bsdf); }
    void prepareSoA(const TextureQuerySoA& q, int begin, int end, Bsdf* bsdf) const override {
        RgbSoA kd;
        m_kd.atSoA(q, begin, end, kd);
        for (int i = begin; i < end; ++i)
            fill(kd.at(i), m_sigma.texture ? m_sigma.at(q.at(i)) : m_sigma.constant, bsdf[i]);
    }

    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const override {
        const Data& data = bsdf.as<Data>();
        for (int i = 0; i < n; ++i) {
            f[i] = data.scaledKd * (brightness(data, wo, wi[i]) * std::abs(wi[i].z));
            if (pdf)
                pdf[i] = pdfMatte(wo, wi[i]);
        }
    }
    void evalCosSoA(const BsdfQuerySoA& jobs, const V3SoA& wi, RgbSoA& f, float* pdf) const override {
        evalMatte(isUniform(), jobs, wi, f);
        if (pdf)
            pdfMatteSoA(jobs, wi, pdf);
    }

    bool sample(const Bsdf& bsdf, const V3f& wo, float, const V2f& u, BsdfSample& out) const override {
        const Data& data = bsdf.as<Data>();
        out.wi = sampleDirection(wo, u);
        out.pdf = pdfMatte(wo, out.wi);
        out.weight = data.scaledKd * (kPi * brightness(data, wo, out.wi));
        out.delta = false;
        out.transmits = false;
        out.eta = 1;
        return out.pdf > 0;
    }
    void sampleSoA(const BsdfQuerySoA& jobs, const float*, const V2SoA& u,
                   BsdfSampleSoA& out) const override {
        sampleMatte(isUniform(), jobs, u, out);
        for (int i = jobs.begin; i < jobs.end; ++i) {
            out.valid[i] = out.pdf[i] > 0;
            out.delta[i] = false;
            out.transmits[i] = false;
        }
    }

    float maxPdf(const Bsdf&, const V3f&) const override { return kInvPi; }
    void maxPdfSoA(const BsdfQuerySoA& jobs, float* out) const override {
        std::fill(out + jobs.begin, out + jobs.end, kInvPi);
    }
    Rgb albedo(const Bsdf& bsdf) const override { return bsdf.as<Data>().scaledKd * kPi; }

  private:
    static void fill(const Rgb& kd, float sigma, Bsdf& bsdf) {
        Data& data = bsdf.as<Data>();
        data.scaledKd = nonNegative(kd) * kInvPi;
        const float s2 = sqr(radians(sigma));
        data.a = 1 - s2 / (2 * (s2 + 0.33f));
        data.b = 0.45f * s2 / (s2 + 0.09f);
    }
    bool isUniform() const { return !m_kd.texture && !m_sigma.texture; }

    RgbInput m_kd;
    FloatInput m_sigma;
};

} // namespace

Plugin<std::shared_ptr<const Material>> mattePlugin() {
    return {"matte",
            "diffuse reflection: Lambertian, or Oren-Nayar if sigma > 0",
            {kKd, kSigma},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<const Matte>(params.get(kKd), params.get(kSigma));
            }};
}

} // namespace strobe
