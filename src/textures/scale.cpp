#include "textures/scale.h"

#include "textures/inputs.h"

namespace strobe {
namespace {

const InputDef kTex1{"tex1", 1, "first factor", "tex"};
const InputDef kTex2{"tex2", 1, "second factor", "scale"};

class Scale : public Texture {
  public:
    Scale(Input a, Input b) : m_a(std::move(a)), m_b(std::move(b)) {}
    Rgb rgb(const TextureQuery& q) const override { return m_a.rgb(q) * m_b.rgb(q); }
    void rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const override {
        RgbSoA b;
        m_a.rgbSoA(q, begin, end, out);
        m_b.rgbSoA(q, begin, end, b);
        for (int i = begin; i < end; ++i)
            out.set(i, out.at(i) * b.at(i));
    }
    float value(const TextureQuery& q) const override { return m_a.value(q) * m_b.value(q); }
    bool needsFootprint() const override { return m_a.needsFootprint() || m_b.needsFootprint(); }
    bool isConstant() const override { return m_a.isConstant() && m_b.isConstant(); }

  private:
    Input m_a, m_b;
};

} // namespace

Plugin<TexturePtr, const TextureArgs&> scaleTexturePlugin() {
    return {"scale",
            "product of two textures",
            {kTex1.color, kTex2.color},
            [](const ParamSet& params, const BuildContext&, const TextureArgs& args) -> TexturePtr {
                return std::make_shared<const Scale>(Input(params, args, kTex1), Input(params, args, kTex2));
            }};
}

} // namespace strobe
