// What the separable filters share: the parameters of their widths, and sampling a tabulated profile.
#pragma once

#include "core/filter.h"
#include "core/params.h"
#include "core/sampling.h"

#include <functional>

namespace strobe {

/// The half-widths of a filter whose default is `fallback` pixels, as parameter definitions.
struct WidthParams {
    explicit WidthParams(float fallback)
        : x{"xwidth", fallback, "half-width across, in pixels", "xradius"}, y{"ywidth", fallback,
                                                                              "half-width down, in pixels",
                                                                              "yradius"} {}
    ParamDef<float> x, y;

    /// Throws a located Error unless both are positive and at most 64 pixels.
    V2f read(const ParamSet& params) const;
    /// As read, with another default.
    V2f read(const ParamSet& params, float fallback) const;
};

/// An even function on [-radius, radius], sampled by its absolute value.
class Profile {
  public:
    using Function = std::function<float(float)>;
    Profile(float radius, Function f);

    struct Sample {
        float x, weight; ///< weight: f/pdf for the normalised f
    };
    Sample sample(float u) const;
    /// The normalised profile: integrates to 1. Zero outside the radius.
    float eval(float x) const;
    float radius() const { return m_radius; }

  private:
    float raw(float x) const { return std::abs(x) < m_radius ? m_f(x) : 0; }
    float m_radius;
    Function m_f;
    PiecewiseLinear1D m_absolute; ///< |f| over [-radius, radius]
    std::vector<bool> m_negative; ///< per interval between the table's nodes
    float m_integral = 1;         ///< of f
    float m_weight = 1;           ///< ∫|f| / ∫f
};

/// A filter that is the product of two profiles.
std::shared_ptr<const Filter> makeSeparable(Profile x, Profile y);

} // namespace strobe
