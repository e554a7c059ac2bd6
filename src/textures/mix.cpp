#include "textures/mix.h"

#include "textures/inputs.h"

namespace strobe {
namespace {

const InputDef kTex1{"tex1", 0, "value where amount is 0"};
const InputDef kTex2{"tex2", 1, "value where amount is 1"};
const ParamDef<FloatInput> kAmount{"amount", .5f, "weight of tex2, 0 to 1; tex1 has weight 1 - amount"};

class Mix : public Texture {
  public:
    Mix(Input a, Input b, FloatInput amount)
        : m_a(std::move(a)), m_b(std::move(b)), m_amount(std::move(amount)) {}
    Rgb rgb(const TextureQuery& q) const override {
        const float t = m_amount.at(q);
        return m_a.rgb(q) * (1 - t) + m_b.rgb(q) * t;
    }
    void rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const override {
        RgbSoA b;
        m_a.rgbSoA(q, begin, end, out);
        m_b.rgbSoA(q, begin, end, b);
        for (int i = begin; i < end; ++i) {
            const float t = m_amount.texture ? m_amount.at(q.at(i)) : m_amount.constant;
            out.set(i, out.at(i) * (1 - t) + b.at(i) * t);
        }
    }
    float value(const TextureQuery& q) const override {
        return lerp(m_a.value(q), m_b.value(q), m_amount.at(q));
    }
    bool needsFootprint() const override {
        return m_a.needsFootprint() || m_b.needsFootprint() || m_amount.needsFootprint();
    }
    bool isConstant() const override {
        return m_a.isConstant() && m_b.isConstant() && (!m_amount.texture || m_amount.texture->isConstant());
    }

  private:
    Input m_a, m_b;
    FloatInput m_amount;
};

} // namespace

Plugin<TexturePtr, const TextureArgs&> mixTexturePlugin() {
    return {"mix",
            "linear interpolation of two textures",
            {kTex1.color, kTex2.color, kAmount},
            [](const ParamSet& params, const BuildContext&, const TextureArgs& args) -> TexturePtr {
                return std::make_shared<const Mix>(Input(params, args, kTex1), Input(params, args, kTex2),
                                                   params.get(kAmount));
            }};
}

} // namespace strobe
