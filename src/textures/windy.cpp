#include "textures/windy.h"

#include "textures/inputs.h"
#include "textures/noise.h"

namespace strobe {
namespace {

class Windy final : public Texture {
  public:
    explicit Windy(const Mapping3D& mapping) : m_mapping(mapping) {}
    Rgb rgb(const TextureQuery& q) const override { return Rgb(value(q)); }
    float value(const TextureQuery& q) const override {
        constexpr float kGust = .1f; // frequency of the wind relative to the waves
        const V3f p = m_mapping.point(q);
        const float width = m_mapping.width(q);
        return std::abs(fbm(p * kGust, width * kGust, {3, .5f})) * fbm(p, width, {6, .5f});
    }

  private:
    Mapping3D m_mapping;
};

} // namespace

Plugin<TexturePtr, const TextureArgs&> windyTexturePlugin() {
    return {"windy",
            "waves in the wind: a product of two sums of noise",
            {},
            [](const ParamSet&, const BuildContext& context, const TextureArgs& args) -> TexturePtr {
                return std::make_shared<const Windy>(Mapping3D(context, args));
            }};
}

} // namespace strobe
