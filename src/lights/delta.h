// The base class of lights with a delta distribution.
#pragma once

#include "core/interfaces/light.h"

namespace strobe {

/// A light that illuminates each point from exactly one direction. Samples need no random numbers and have
/// pdf 1. Derived classes implement `deltaSample` and `power`.
class DeltaLight : public Light {
  public:
    void sample(const V3f& p, float time, const V2f*, int n, LightSample* out) const final {
        const LightSample s = deltaSample(p, time);
        for (int i = 0; i < n; ++i)
            out[i] = s;
    }
    void sampleSoA(const LightQuerySoA& query, LightSampleSoA& out) const override {
        LightSample s{};
        for (int i = 0; i < query.n; ++i) {
            if (i == 0 || query.point[i] != query.point[i - 1])
                s = deltaSample(query.p.at(i), query.time[i]);
            out.set(i, s);
        }
    }
    LightSample sampleEmitter(uint32_t, const V3f& p, float time, const V2f&) const final {
        return deltaSample(p, time);
    }
    float pdf(const V3f&, float, const V3f&, const LightHit*) const final { return 0; }
    bool mayIntersect(const V3f&, float, const V3f&) const final { return false; }
    float solidAngle(const V3f&, float) const final { return 0; }
    bool isDelta() const final { return true; }

  protected:
    /// Returns the sample for point `p` at shutter fraction `time`, with pdf 1.
    virtual LightSample deltaSample(const V3f& p, float time) const = 0;
    /// Returns the sample of a point light at `position` for point `p`: radiance is intensity / distance²;
    /// black if the points coincide.
    static STROBE_FORCE_INLINE LightSample fromPoint(const V3f& p, const V3f& position,
                                                     const Rgb& intensity) {
        const V3f d = position - p;
        const float d2 = length2(d), distance = std::sqrt(d2), invDistance = 1 / distance, invD2 = 1 / d2;
        const bool isDistinct = d2 > 0;
        LightSample s;
        s.wi.x = isDistinct ? d.x * invDistance : 0;
        s.wi.y = isDistinct ? d.y * invDistance : 0;
        s.wi.z = isDistinct ? d.z * invDistance : 1;
        s.distance = distance;
        s.pdf = 1;
        s.radiance.x = isDistinct ? intensity.x * invD2 : 0;
        s.radiance.y = isDistinct ? intensity.y * invD2 : 0;
        s.radiance.z = isDistinct ? intensity.z * invD2 : 0;
        return s;
    }
};

} // namespace strobe
