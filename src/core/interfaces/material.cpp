#include "core/interfaces/material.h"

namespace strobe {

void Material::evalCosSoA(const BsdfQuerySoA& query, const V3SoA& wi, RgbSoA& f, float* pdf) const {
    V3f directions[kSoAWidth];
    Rgb values[kSoAWidth];
    float densities[kSoAWidth];
    int evaluation[kSoAWidth];
    for (int begin = query.begin, end; begin < query.end; begin = end) {
        const int32_t point = query.point[begin];
        int n = 0;
        for (end = begin; end < query.end && query.point[end] == point; ++end)
            if (query.isActive(end)) {
                evaluation[n] = end;
                directions[n++] = wi.at(end);
            }
        if (n == 0)
            continue;
        evalCos(query.bsdf[point], query.wo.at(begin), directions, n, values, pdf ? densities : nullptr);
        for (int i = 0; i < n; ++i) {
            f.set(evaluation[i], values[i]);
            if (pdf)
                pdf[evaluation[i]] = densities[i];
        }
    }
}

void Material::sampleSoA(const BsdfQuerySoA& query, const float* uc, const V2SoA& u,
                         BsdfSampleSoA& out) const {
    for (int i = query.begin; i < query.end; ++i) {
        BsdfSample s;
        out.valid[i] =
            query.isActive(i) && sample(query.bsdf[query.point[i]], query.wo.at(i), uc[i], u.at(i), s);
        if (out.valid[i])
            out.set(i, s);
    }
}

void Material::maxPdfSoA(const BsdfQuerySoA& query, float* out) const {
    for (int i = query.begin; i < query.end; ++i)
        out[i] = maxPdf(query.bsdf[query.point[i]], query.wo.at(i));
}

} // namespace strobe
