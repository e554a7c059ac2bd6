// A base class for materials of smooth lobes. A lobe is written once, for one pair of directions; the same
// inline functions serve single directions and vectorized loops over many.
//
// A lobe type has
//   LobeValue eval(wo, wi)                        the value and density of a pair of directions;
//   int32_t sampleDirection(wo, uc, u, wi)        draws wi with that density; 0: the sample is absorbed;
//   float maxPdf(wo)                              an upper bound of the density over all wi;
// `uc` in [0,1) picks a component of the lobe, `u` in [0,1)² a direction.
#pragma once

#include "core/interfaces/material.h"

#include <utility>

namespace strobe {

/// f |cos wi| and the density per solid angle for a pair of directions.
struct LobeValue {
    float r, g, b, pdf;
};

// Loops over the jobs of a BsdfQuerySoA. `lobes.at(job)` returns the lobe at the point of the job.

/// Writes the value and the density of each job's pair of directions.
template <class Lobes>
STROBE_TARGET_CLONES void evalLobes(const Lobes& lobes, const BsdfQuerySoA& jobs, const V3SoA& wi, RgbSoA& f,
                                    float* pdf) {
    const int begin = jobs.begin, end = jobs.end;
    const V3SoA& wo = jobs.wo;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const LobeValue v = lobes.at(i).eval(wo.at(i), wi.at(i));
        f.r[i] = v.r;
        f.g[i] = v.g;
        f.b[i] = v.b;
        pdf[i] = v.pdf;
    }
}

/// Draws a direction for each job; drawn[i] is 0 if the sample is absorbed.
template <class Lobes>
STROBE_TARGET_CLONES void sampleLobes(const Lobes& lobes, const BsdfQuerySoA& jobs, const float* uc,
                                      const V2SoA& u, V3SoA& wi, int32_t* drawn) {
    const int begin = jobs.begin, end = jobs.end;
    const V3SoA& wo = jobs.wo;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        V3f w;
        drawn[i] = lobes.at(i).sampleDirection(wo.at(i), uc[i], u.at(i), w);
        wi.x[i] = w.x;
        wi.y[i] = w.y;
        wi.z[i] = w.z;
    }
}

/// Writes an upper bound of the density for each job.
template <class Lobes>
STROBE_TARGET_CLONES void boundPdfs(const Lobes& lobes, const BsdfQuerySoA& jobs, float* out) {
    const int begin = jobs.begin, end = jobs.end;
    const V3SoA& wo = jobs.wo;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i)
        out[i] = lobes.at(i).maxPdf(wo.at(i));
}

/// Completes samples of smooth lobes. Before: out.weight holds f |cos wi|, out.pdf the density. After:
/// out.weight is divided by the density and all other members are set.
inline void finishSamples(const BsdfQuerySoA& jobs, const int32_t* drawn, BsdfSampleSoA& out) {
    for (int i = jobs.begin; i < jobs.end; ++i) {
        const float scale = 1 / out.pdf[i];
        out.weight.r[i] *= scale;
        out.weight.g[i] *= scale;
        out.weight.b[i] *= scale;
        out.valid[i] = drawn[i] && out.pdf[i] > 0;
        out.delta[i] = false;
        out.transmits[i] = false;
    }
}
/// Completes the samples of Material::sampleDirectionSoA: sets all members except wi, weight and pdf.
inline void finishDirections(const BsdfQuerySoA& jobs, const int32_t* drawn, BsdfSampleSoA& out) {
    for (int i = jobs.begin; i < jobs.end; ++i) {
        out.valid[i] = drawn[i];
        out.delta[i] = false;
        out.transmits[i] = false;
    }
}

/// The `Data` of each job's point as a structure of arrays. `Data`: a struct of floats in Bsdf::data.
template <class Data>
struct DataSoA {
    static constexpr size_t kNumbers = sizeof(Data) / sizeof(float);
    alignas(64) float number[kNumbers][kSoAWidth];

    explicit DataSoA(const BsdfQuerySoA& jobs) {
        for (size_t k = 0; k < kNumbers; ++k)
            for (int i = jobs.begin; i < jobs.end; ++i)
                number[k][i] = jobs.bsdfData(jobs.point[i], int(k));
    }
    STROBE_FORCE_INLINE Data at(int job) const { return at(job, std::make_index_sequence<kNumbers>()); }

  private:
    template <size_t... k>
    STROBE_FORCE_INLINE Data at(int job, std::index_sequence<k...>) const {
        return {number[k][job]...};
    }
};

/// A material with one lobe, of type `Data`: a struct of floats that `prepare` writes to Bsdf::data.
template <class Data>
class LobeMaterial : public Material {
  public:
    void evalCos(const Bsdf& bsdf, const V3f& wo, const V3f* wi, int n, Rgb* f, float* pdf) const final {
        for (int i = 0; i < n; ++i) {
            const LobeValue v = bsdf.as<Data>().eval(wo, wi[i]);
            f[i] = {v.r, v.g, v.b};
            if (pdf)
                pdf[i] = v.pdf;
        }
    }
    void evalCosSoA(const BsdfQuerySoA& jobs, const V3SoA& wi, RgbSoA& f, float* pdf) const final {
        alignas(64) float ignoredPdf[kSoAWidth];
        evalLobes(DataSoA<Data>(jobs), jobs, wi, f, pdf ? pdf : ignoredPdf);
    }
    bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const final {
        const Data& data = bsdf.as<Data>();
        if (!data.sampleDirection(wo, uc, u, out.wi))
            return false;
        const LobeValue v = data.eval(wo, out.wi);
        out.weight = Rgb(v.r, v.g, v.b) * (1 / v.pdf);
        out.pdf = v.pdf;
        out.delta = false;
        out.transmits = false;
        out.eta = 1;
        return v.pdf > 0;
    }
    void sampleSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                   BsdfSampleSoA& out) const final {
        alignas(64) int32_t drawn[kSoAWidth];
        const DataSoA<Data> lobes(jobs);
        sampleLobes(lobes, jobs, uc, u, out.wi, drawn);
        evalLobes(lobes, jobs, out.wi, out.weight, out.pdf);
        finishSamples(jobs, drawn, out);
    }
    void sampleDirectionSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                            BsdfSampleSoA& out) const final {
        alignas(64) int32_t drawn[kSoAWidth];
        sampleLobes(DataSoA<Data>(jobs), jobs, uc, u, out.wi, drawn);
        finishDirections(jobs, drawn, out);
    }
    float maxPdf(const Bsdf& bsdf, const V3f& wo) const final { return bsdf.as<Data>().maxPdf(wo); }
    void maxPdfSoA(const BsdfQuerySoA& jobs, float* out) const final {
        boundPdfs(DataSoA<Data>(jobs), jobs, out);
    }

  protected:
    using Material::Material;
};

} // namespace strobe
