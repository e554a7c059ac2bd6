#include "core/interfaces/light.h"

namespace strobe {

void Light::sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const {
    V2f u[kSoAWidth];
    LightSample samples[kSoAWidth];
    for (int begin = 0, end; begin < query.n; begin = end) {
        const int32_t point = query.point[begin];
        for (end = begin; end < query.n && query.point[end] == point; ++end)
            u[end - begin] = query.u.at(end);
        sample(query.p.at(begin), query.time[begin], u, end - begin, samples);
        for (int i = begin; i < end; ++i)
            out.set(i, samples[i - begin]);
    }
}

LightSample Light::sampleEmitter(uint32_t, const V3f& p, float time, const V2f& u) const {
    LightSample s;
    sample(p, time, &u, 1, &s);
    return s;
}

void Light::environmentSoA(const V3SoA& d, int n, RgbSoA& radiance, float* pdf) const {
    for (int i = 0; i < n; ++i) {
        radiance.set(i, environment(d.at(i)));
        if (pdf)
            pdf[i] = this->pdf(V3f(0), 0, d.at(i), nullptr);
    }
}

void Light::solidAngleSoA(const V3SoA& p, const float* time, int n, float* out) const {
    for (int i = 0; i < n; ++i)
        out[i] = solidAngle(p.at(i), time[i]);
}

} // namespace strobe
