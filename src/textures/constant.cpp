#include "textures/constant.h"

#include "textures/inputs.h"

namespace strobe {
namespace {

const InputDef kValue{"value", 1, "value"};

class Constant : public Texture {
  public:
    Constant(const Rgb& color, float value) : m_color(color), m_value(value) {}
    Rgb rgb(const TextureQuery&) const override { return m_color; }
    float value(const TextureQuery&) const override { return m_value; }
    bool isConstant() const override { return true; }

  private:
    Rgb m_color;
    float m_value;
};

} // namespace

Plugin<TexturePtr, const TextureArgs&> constantTexturePlugin() {
    return {"constant",
            "the same value everywhere",
            {kValue.color},
            [](const ParamSet& params, const BuildContext&, const TextureArgs& args) -> TexturePtr {
                const Input input(params, args, kValue);
                if (!input.isConstant())
                    throw Error(params.whereIs(kValue.color),
                                "the value of a constant texture must be constant");
                return std::make_shared<const Constant>(input.rgb({}), input.value({}));
            }};
}

} // namespace strobe
