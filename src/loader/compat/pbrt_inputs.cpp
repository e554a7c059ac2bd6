#include "loader/compat/pbrt_inputs.h"

#include <cmath>

namespace strobe {
namespace {

/// A texture that is a function of two inputs.
template <class In, class Out>
class FunctionTexture final : public Texture {
  public:
    using F = std::function<Out(const In&, const In&)>;
    template <class Input>
    FunctionTexture(const Input& a, const Input& b, F f) : m_f(std::move(f)) {
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

/// Returns f of two inputs; a texture if one of them is a texture.
template <class OutInput, class Value, class Out, class Input>
OutInput compute(const Input& a, const Input& b, std::function<Out(const Value&, const Value&)> f) {
    OutInput out(f(a.constant, b.constant));
    if (a.texture || b.texture)
        out.texture = std::make_shared<const FunctionTexture<Value, Out>>(a, b, std::move(f));
    return out;
}

/// Returns the mean over the unit square of texture coordinates, by 16 x 16 samples.
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

} // namespace

FloatInput mapped(const FloatInput& in, std::function<float(float)> f) {
    return combined(in, in, [f = std::move(f)](float a, float) { return f(a); });
}

RgbInput mapped(const RgbInput& in, std::function<Rgb(const Rgb&)> f) {
    return combined(in, in, [f = std::move(f)](const Rgb& a, const Rgb&) { return f(a); });
}

FloatInput toGray(const RgbInput& in, std::function<float(const Rgb&)> f) {
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

Roughness readRoughness(const ParamSet& params, const RoughnessDefs& defs, RoughnessRule rule) {
    if (!params.get(defs.remap))
        rule = RoughnessRule::Alpha;
    const auto converted = [rule](const FloatInput& in) {
        return mapped(in, [rule](float r) { return std::sqrt(alphaOf(r, rule)); });
    };
    const FloatInput both = params.get(defs.both);
    const FloatInput u = params.has(defs.u) ? params.get(defs.u) : both;
    const FloatInput v = params.has(defs.v) ? params.get(defs.v) : both;
    const bool isAnisotropic =
        (params.has(defs.u) || params.has(defs.v)) && (u.texture || v.texture || u.constant != v.constant);
    return {converted(u), isAnisotropic ? std::optional(converted(v)) : std::nullopt};
}

FloatInput Roughness::mean() const {
    return v ? combined(u, *v, [](float a, float b) { return std::sqrt(a * b); }) : u;
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
        const float k2 = k[i] * k[i];
        const float etaMinus = eta[i] - 1;
        const float etaPlus = eta[i] + 1;
        r[i] = (etaMinus * etaMinus + k2) / (etaPlus * etaPlus + k2);
    }
    return r;
}

} // namespace strobe
