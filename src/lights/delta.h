// The base of lights that are seen in a single direction.
#pragma once

#include "core/light.h"

namespace strobe {

/// A light with one direction per point: everything but `only` and `power` is settled.
class DeltaLight : public Light {
  public:
    void sample(const V3f& p, float time, const V2f*, int n, LightSample* out) const final {
        const LightSample s = only(p, time);
        for (int i = 0; i < n; ++i)
            out[i] = s;
    }
    float pdf(const V3f&, float, const V3f&, const LightHit*) const final { return 0; }
    bool mayMeet(const V3f&, float, const V3f&) const final { return false; }
    float solidAngle(const V3f&, float) const final { return 0; }
    bool isDelta() const final { return true; }

  protected:
    /// The light's one sample, pdf = 1.
    virtual LightSample only(const V3f& p, float time) const = 0;
    /// Light of intensity `intensity` that arrives from a point; black at that very point.
    static LightSample fromPoint(const V3f& p, const V3f& light, const Rgb& intensity) {
        const V3f d = light - p;
        const float d2 = length2(d);
        if (!(d2 > 0))
            return {V3f(0, 0, 1), 0, Rgb(0), 1};
        return {normalize(d), std::sqrt(d2), intensity * (1 / d2), 1};
    }
};

} // namespace strobe
