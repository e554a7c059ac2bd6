#include "textures/directionmix.h"

#include "textures/inputs.h"

namespace strobe {
namespace {

const InputDef kTex1{"tex1", 0, "value where the surface faces the direction"},
    kTex2{"tex2", 1, "value where the surface is parallel to the direction"};
const ParamDef<V3f> kDir{"dir", V3f(0, 1, 0), "direction"};

class DirectionMix final : public Texture {
  public:
    /// `direction`: unit vector in world space.
    DirectionMix(Input a, Input b, const V3f& direction)
        : m_a(std::move(a)), m_b(std::move(b)), m_direction(direction) {}
    Rgb rgb(const TextureQuery& q) const override {
        const float w = weight(q);
        return m_a.rgb(q) * w + m_b.rgb(q) * (1 - w);
    }
    float value(const TextureQuery& q) const override { return lerp(m_b.value(q), m_a.value(q), weight(q)); }
    bool needsFootprint() const override { return m_a.needsFootprint() || m_b.needsFootprint(); }
    bool isConstant() const override { return m_a.equals(m_b); }

  private:
    float weight(const TextureQuery& q) const {
        return std::min(std::abs(dot(normalizeAny(q.n), m_direction)), 1.f);
    }
    Input m_a, m_b;
    V3f m_direction;
};

} // namespace

Plugin<TexturePtr, const TextureArgs&> directionMixTexturePlugin() {
    return {"directionmix",
            "mix of two inputs by the angle between the surface and a direction",
            {kTex1.color, kTex2.color, kDir},
            [](const ParamSet& params, const BuildContext&, const TextureArgs& args) -> TexturePtr {
                const V3f world = transformVector(args.toWorld, params.get(kDir));
                if (!(length2(world) > 0))
                    throw Error(params.whereIs(kDir), "\"dir\" must not be zero");
                return std::make_shared<const DirectionMix>(Input(params, args, kTex1),
                                                            Input(params, args, kTex2), normalizeAny(world));
            }};
}

} // namespace strobe
