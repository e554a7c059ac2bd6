#include "textures/fbm.h"

#include "textures/inputs.h"
#include "textures/noise.h"

namespace strobe {
namespace {

/// A sum of octaves of noise; `Sum` is fbm or turbulence.
template <float (&Sum)(const V3f&, float, const Octaves&)>
class NoiseSum final : public Texture {
  public:
    NoiseSum(const Mapping3D& mapping, const Octaves& octaves) : m_mapping(mapping), m_octaves(octaves) {}
    Rgb rgb(const TextureQuery& q) const override { return Rgb(value(q)); }
    float value(const TextureQuery& q) const override {
        return Sum(m_mapping.point(q), m_mapping.width(q), m_octaves);
    }

  private:
    Mapping3D m_mapping;
    Octaves m_octaves;
};

template <float (&Sum)(const V3f&, float, const Octaves&)>
Plugin<TexturePtr, const TextureArgs&> noisePlugin(const char* name, const char* doc) {
    return {name,
            doc,
            {kOctaves, kOctaveRoughness},
            [](const ParamSet& params, const BuildContext& context, const TextureArgs& args) -> TexturePtr {
                return std::make_shared<const NoiseSum<Sum>>(Mapping3D(context, args), readOctaves(params));
            }};
}

} // namespace

Plugin<TexturePtr, const TextureArgs&> fbmTexturePlugin() {
    return noisePlugin<fbm>("fbm", "sum of octaves of noise");
}

Plugin<TexturePtr, const TextureArgs&> wrinkledTexturePlugin() {
    return noisePlugin<turbulence>("wrinkled", "sum of the magnitudes of octaves of noise");
}

} // namespace strobe
