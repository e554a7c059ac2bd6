#include "loader/compat/pbrt_inputs.h"

#include <cmath>

namespace strobe {
namespace {

/// A texture computed from up to two inputs.
template <class In, class Out>
class Computed final : public Texture {
  public:
    using F = std::function<Out(const In&, const In&)>;
    template <class Input>
    Computed(const Input& a, const Input& b, F f) : m_f(std::move(f)) {
        m_a = [a](const TextureQuery& q) { return a.at(q); };
        m_b = [b](const TextureQuery& q) { return b.at(q); };
        m_needsFootprint = a.needsFootprint() || b.needsFootprint();
    }
    Rgb rgb(const TextureQuery& q) const override { return Rgb(m_f(m_a(q), m_b(q))); }
    bool needsFootprint() const override { return m_needsFootprint; }

  private:
    F m_f;
    std::function<In(const TextureQuery&)> m_a, m_b;
    bool m_needsFootprint;
};

template <class OutInput, class Value, class Out, class Input>
OutInput compute(const Input& a, const Input& b, std::function<Out(const Value&, const Value&)> f) {
    OutInput out(f(a.constant, b.constant));
    if (a.texture || b.texture)
        out.texture = std::make_shared<const Computed<Value, Out>>(a, b, std::move(f));
    return out;
}

template <class Input>
auto meanOverSquare(const Input& in) {
    constexpr int kSide = 16;
    auto sum = in.at({}) * 0;
    for (int i = 0; i < kSide * kSide; ++i) {
        TextureQuery q;
        q.uv = V2f(float(i % kSide) + .5f, float(i / kSide) + .5f) / float(kSide);
        q.p = V3f(q.uv.x, q.uv.y, 0);
        sum += in.at(q) * (1.f / (kSide * kSide));
    }
    return sum;
}

/// pbrt-v3's way from roughness, 0 to 1, to alpha: a polynomial in its logarithm.
float polynomialAlpha(float roughness) {
    const float x = std::log(std::max(roughness, 1e-3f));
    return 1.62142f + x * (0.819955f + x * (0.1734f + x * (0.0171201f + x * 0.000640711f)));
}

/// The alpha at which GGX's lobe is as wide at its peak as (n·h)^(1/roughness).
float blinnAlpha(float roughness) { return std::sqrt(2 * roughness / (1 + 2 * roughness)); }

float alphaOf(float roughness, RoughnessRule rule) {
    const float r = std::max(roughness, 0.f);
    return rule == RoughnessRule::BlinnExponent ? blinnAlpha(r)
           : rule == RoughnessRule::Polynomial  ? polynomialAlpha(r)
                                                : std::sqrt(r);
}

} // namespace

FloatInput mapped(const FloatInput& in, std::function<float(float)> f) {
    return combined(in, in, [f = std::move(f)](float a, float) { return f(a); });
}

RgbInput mapped(const RgbInput& in, std::function<Rgb(const Rgb&)> f) {
    return combined(in, in, [f = std::move(f)](const Rgb& a, const Rgb&) { return f(a); });
}

FloatInput grayOf(const RgbInput& in, std::function<float(const Rgb&)> f) {
    return compute<FloatInput, Rgb, float>(in, in,
                                           [f = std::move(f)](const Rgb& a, const Rgb&) { return f(a); });
}

RgbInput combined(const RgbInput& a, const RgbInput& b, std::function<Rgb(const Rgb&, const Rgb&)> f) {
    return compute<RgbInput, Rgb, Rgb>(a, b, std::move(f));
}

FloatInput combined(const FloatInput& a, const FloatInput& b, std::function<float(float, float)> f) {
    return compute<FloatInput, float, float>(
        a, b, [f = std::move(f)](const float& x, const float& y) { return f(x, y); });
}

float meanOf(const RgbInput& in) { return luminance(in.texture ? meanOverSquare(in) : in.constant); }
float meanOf(const FloatInput& in) { return in.texture ? meanOverSquare(in) : in.constant; }

FloatInput readRoughness(const ParamSet& params, const RoughnessDefs& defs, RoughnessRule rule) {
    const bool remap = params.get(defs.remap);
    const auto toAlpha = [remap, rule](float r) { return remap ? alphaOf(r, rule) : std::max(r, 0.f); };
    const FloatInput both = params.get(defs.both);
    const FloatInput u = params.has(defs.u) ? params.get(defs.u) : both;
    const FloatInput v = params.has(defs.v) ? params.get(defs.v) : both;
    // Of two widths, the geometric mean: the lobe covers as large a solid angle.
    return combined(u, v, [toAlpha](float a, float b) {
        return std::pow(std::min(toAlpha(a), 1.f) * std::min(toAlpha(b), 1.f), 0.25f);
    });
}

FloatInput readIndex(const ParamSet& params, const ParamDef<FloatInput>& def) {
    const auto type = params.typeOf(def);
    if (type != ParamType::Spectrum && type != ParamType::Rgb)
        return params.get(def);
    const Rgb index = params.get(ParamDef<Rgb>{def.name, Rgb(1.5f), "", def.alias});
    return FloatInput((index.x + index.y + index.z) / 3);
}

Rgb conductorReflectance(const Rgb& eta, const Rgb& k) {
    Rgb r;
    for (int i = 0; i < 3; ++i) {
        const float k2 = k[i] * k[i], less = eta[i] - 1, more = eta[i] + 1;
        r[i] = (less * less + k2) / (more * more + k2);
    }
    return r;
}

} // namespace strobe
