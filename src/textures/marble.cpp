#include "textures/marble.h"

#include "textures/inputs.h"
#include "textures/noise.h"

namespace strobe {
namespace {

const ParamDef<float> kScale{"scale", 1.f, "scale of the position"};
const ParamDef<float> kVariation{"variation", .2f, "scale of the disturbance of the layers"};

/// Returns the color of the spline of pbrt's marble at t in [0,1]. pbrt-v3 uses only the first two segments,
/// and extrapolates the second.
Rgb marbleColor(float t, bool isV3) {
    constexpr int kSegments = 6;
    static const Rgb kColors[kSegments + 3] = {
        {.58f, .58f, .6f}, {.58f, .58f, .6f}, {.58f, .58f, .6f}, {.5f, .5f, .5f},   {.6f, .59f, .58f},
        {.58f, .58f, .6f}, {.58f, .58f, .6f}, {.2f, .2f, .33f},  {.58f, .58f, .6f},
    };
    const int first = std::clamp(int(t * kSegments), 0, isV3 ? 1 : kSegments - 1);
    const float x = t * kSegments - float(first);
    Rgb c[4];
    std::copy_n(kColors + first, 4, c);
    for (int level = 3; level > 0; --level) // de Casteljau
        for (int i = 0; i < level; ++i)
            c[i] = c[i] * (1 - x) + c[i + 1] * x;
    return c[0] * 1.5f;
}

class Marble final : public Texture {
  public:
    Marble(const Mapping3D& mapping, const Octaves& octaves, float scale, float variation, bool isV3)
        : m_mapping(mapping), m_octaves(octaves), m_scale(scale), m_variation(variation), m_isV3(isV3) {}
    Rgb rgb(const TextureQuery& q) const override {
        const V3f p = m_mapping.point(q) * m_scale;
        const float phase = p.y + m_variation * fbm(p, m_mapping.width(q) * std::abs(m_scale), m_octaves);
        return marbleColor(.5f + .5f * std::sin(phase), m_isV3);
    }

  private:
    Mapping3D m_mapping;
    Octaves m_octaves;
    float m_scale, m_variation;
    bool m_isV3;
};

} // namespace

Plugin<TexturePtr, const TextureArgs&> marbleTexturePlugin() {
    return {"marble",
            "layers of stone colors, disturbed by noise",
            {kOctaves, kOctaveRoughness, kScale, kVariation},
            [](const ParamSet& params, const BuildContext& context, const TextureArgs& args) -> TexturePtr {
                return std::make_shared<const Marble>(Mapping3D(context, args), readOctaves(params),
                                                      params.get(kScale), params.get(kVariation),
                                                      context.isLenient && context.pbrtVersion == 3);
            }};
}

} // namespace strobe
