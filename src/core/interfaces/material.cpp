#include "core/interfaces/material.h"

namespace strobe {

void Material::evalCosSoA(const BsdfQuerySoA& jobs, const V3SoA& wi, RgbSoA& f, float* pdf) const {
    V3f directions[kSoAWidth];
    Rgb values[kSoAWidth];
    float densities[kSoAWidth];
    int job[kSoAWidth];
    for (int begin = jobs.begin, end; begin < jobs.end; begin = end) {
        const int32_t point = jobs.point[begin];
        int n = 0;
        for (end = begin; end < jobs.end && jobs.point[end] == point; ++end)
            if (jobs.wants(end))
                job[n] = end, directions[n++] = wi.at(end);
        if (n == 0)
            continue;
        evalCos(jobs.bsdf[point], jobs.wo.at(begin), directions, n, values, pdf ? densities : nullptr);
        for (int i = 0; i < n; ++i) {
            f.set(job[i], values[i]);
            if (pdf)
                pdf[job[i]] = densities[i];
        }
    }
}

void Material::sampleSoA(const BsdfQuerySoA& jobs, const float* uc, const V2SoA& u,
                         BsdfSampleSoA& out) const {
    for (int i = jobs.begin; i < jobs.end; ++i) {
        BsdfSample sampled;
        out.valid[i] =
            jobs.wants(i) && sample(jobs.bsdf[jobs.point[i]], jobs.wo.at(i), uc[i], u.at(i), sampled);
        if (out.valid[i])
            out.set(i, sampled);
    }
}

void Material::maxPdfSoA(const BsdfQuerySoA& jobs, float* out) const {
    for (int i = jobs.begin; i < jobs.end; ++i)
        out[i] = maxPdf(jobs.bsdf[jobs.point[i]], jobs.wo.at(i));
}

} // namespace strobe
