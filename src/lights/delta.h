// The base of lights that are seen in a single direction.
#pragma once

#include "core/interfaces/light.h"

namespace strobe {

/// A light with one direction per point: everything but `only` and `power` is settled.
class DeltaLight : public Light {
  public:
    void sample(const V3f& p, float time, const V2f*, int n, LightSample* out) const final {
        const LightSample s = only(p, time);
        for (int i = 0; i < n; ++i)
            out[i] = s;
    }
    void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const override {
        LightSample s{};
        for (int i = 0; i < query.n; ++i) {
            if (i == 0 || query.point[i] != query.point[i - 1])
                s = only(query.p.at(i), query.time[i]);
            out.set(i, s);
        }
    }
    float pdf(const V3f&, float, const V3f&, const LightHit*) const final { return 0; }
    bool mayIntersect(const V3f&, float, const V3f&) const final { return false; }
    float solidAngle(const V3f&, float) const final { return 0; }
    bool isDelta() const final { return true; }

  protected:
    /// The light's one sample, pdf = 1.
    virtual LightSample only(const V3f& p, float time) const = 0;
    /// Light of intensity `intensity` that arrives from a point; black at that very point.
    static STROBE_FORCE_INLINE LightSample fromPoint(const V3f& p, const V3f& light, const Rgb& intensity) {
        const V3f d = light - p;
        const float d2 = length2(d), distance = std::sqrt(d2), along = 1 / distance, fall = 1 / d2;
        const bool isApart = d2 > 0;
        LightSample s;
        s.wi.x = isApart ? d.x * along : 0, s.wi.y = isApart ? d.y * along : 0;
        s.wi.z = isApart ? d.z * along : 1;
        s.distance = distance, s.pdf = 1;
        s.radiance.x = isApart ? intensity.x * fall : 0, s.radiance.y = isApart ? intensity.y * fall : 0;
        s.radiance.z = isApart ? intensity.z * fall : 0;
        return s;
    }
};

} // namespace strobe
