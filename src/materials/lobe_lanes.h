// Materials of smooth lobes, given what their lobes do for one pair of directions: the same functions serve
// single directions and loops over many.
#pragma once

#include "core/interfaces/material.h"

#include <utility>

namespace strobe {

/// f |cos wi| and the density of a pair of directions.
struct LobeValue {
    float r, g, b, pdf;
};

// Loops over jobs. `lobes.at(job)` is the lobe at the job's point: it has eval(wo, wi), a LobeValue;
// draw(wo, uc, u, wi), 0 when nothing is drawn; and maxPdf(wo).

template <class Lobes>
STROBE_TARGET_CLONES void evalLobes(const Lobes& lobes, const BsdfQuerySoA& jobs, const V3SoA& wi, RgbSoA& f,
                                    float* pdf) {
    const int begin = jobs.begin, end = jobs.end;
    const V3SoA& wo = jobs.wo;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        const LobeValue v = lobes.at(i).eval(wo.at(i), wi.at(i));
        f.r[i] = v.r, f.g[i] = v.g, f.b[i] = v.b;
        pdf[i] = v.pdf;
    }
}

template <class Lobes>
STROBE_TARGET_CLONES void drawLobes(const Lobes& lobes, const BsdfQuerySoA& jobs, const float* uc,
                                    const V2SoA& u, V3SoA& wi, int32_t* drawn) {
    const int begin = jobs.begin, end = jobs.end;
    const V3SoA& wo = jobs.wo;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        V3f w;
        drawn[i] = lobes.at(i).draw(wo.at(i), uc[i], u.at(i), w);
        wi.x[i] = w.x, wi.y[i] = w.y, wi.z[i] = w.z;
    }
}

template <class Lobes>
STROBE_TARGET_CLONES void boundPdfs(const Lobes& lobes, const BsdfQuerySoA& jobs, float* out) {
    const int begin = jobs.begin, end = jobs.end;
    const V3SoA& wo = jobs.wo;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i)
        out[i] = lobes.at(i).maxPdf(wo.at(i));
}

/// Makes samples of drawn directions whose values (in place of the weights) and densities are there.
inline void finishSamples(const BsdfQuerySoA& jobs, const int32_t* drawn, BsdfSampleSoA& out) {
    for (int i = jobs.begin; i < jobs.end; ++i) {
        const float scale = 1 / out.pdf[i];
        out.weight.r[i] *= scale, out.weight.g[i] *= scale, out.weight.b[i] *= scale;
        out.valid[i] = drawn[i] && out.pdf[i] > 0;
        out.delta[i] = out.transmits[i] = false;
    }
}
inline void finishDirections(const BsdfQuerySoA& jobs, const int32_t* drawn, BsdfSampleSoA& out) {
    for (int i = jobs.begin; i < jobs.end; ++i)
        out.valid[i] = drawn[i], out.delta[i] = out.transmits[i] = false;
}

/// The numbers of a `Data`, a struct of floats that a material keeps of a point, by job.
template <class Data>
struct DataRows {
    static constexpr size_t kNumbers = sizeof(Data) / sizeof(float);
    alignas(64) float row[kNumbers][kSoAWidth];

    explicit DataRows(const BsdfQuerySoA& jobs) {
        for (size_t k = 0; k < kNumbers; ++k)
            for (int i = jobs.begin; i < jobs.end; ++i)
                row[k][i] = jobs.bsdfData(jobs.point[i], int(k));
    }
    STROBE_FORCE_INLINE Data at(int job) const { return at(job, std::make_index_sequence<kNumbers>()); }

  private:
    template <size_t... k>
    STROBE_FORCE_INLINE Data at(int job, std::index_sequence<k...>) const {
        return {row[k][job]...};
    }
};

/// A material whose lobes a `Data` in Bsdf::data tells: a struct of floats with eval, draw and maxPdf.
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
        alignas(64) float unwanted[kSoAWidth];
        evalLobes(DataRows<Data>(jobs), jobs, wi, f, pdf ? pdf : unwanted);
    }
    bool sample(const Bsdf& bsdf, const V3f& wo, float uc, const V2f& u, BsdfSample& out) const final {
        const Data& data = bsdf.as<Data>();
        if (!data.draw(wo, uc, u, out.wi))
            return false;
        const LobeValue v = data.eval(wo, out.wi);
        out.weight = Rgb(v.r, v.g, v.b) * (1 / v.pdf);
        out.pdf = v.pdf;
        out.delta = out.transmits = false;
        out.eta = 1;
        return v.pdf > 0;
    }
    void sampleSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                   BsdfSampleSoA& out) const final {
        alignas(64) int32_t drawn[kSoAWidth];
        const DataRows<Data> rows(jobs);
        drawLobes(rows, jobs, uc, u, out.wi, drawn);
        evalLobes(rows, jobs, out.wi, out.weight, out.pdf);
        finishSamples(jobs, drawn, out);
    }
    void sampleDirectionSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                            BsdfSampleSoA& out) const final {
        alignas(64) int32_t drawn[kSoAWidth];
        drawLobes(DataRows<Data>(jobs), jobs, uc, u, out.wi, drawn);
        finishDirections(jobs, drawn, out);
    }
    float maxPdf(const Bsdf& bsdf, const V3f& wo) const final { return bsdf.as<Data>().maxPdf(wo); }
    void maxPdfSoA(const BsdfQuerySoA& jobs, float* out) const final {
        boundPdfs(DataRows<Data>(jobs), jobs, out);
    }

  protected:
    using Material::Material;
};

} // namespace strobe
