#include "loader/compat/pbrt_compat.h"

#include "textures/inputs.h"

namespace strobe {
namespace {

class Constant final : public Texture {
  public:
    explicit Constant(const Rgb& value) : m_value(value) {}
    Rgb rgb(const TextureQuery&) const override { return m_value; }
    bool isConstant() const override { return true; }

  private:
    Rgb m_value;
};

const InputDef kV00{"v00", 0, "value at (0,0)"}, kV01{"v01", 1, "value at (0,1)"},
    kV10{"v10", 0, "value at (1,0)"}, kV11{"v11", 1, "value at (1,1)"};

/// Bilinear interpolation and extrapolation of four values.
class Bilerp final : public Texture {
  public:
    Bilerp(const ParamSet& params, const BuildContext& context, const TextureArgs& args)
        : m_mapping(params, context, args), m_v00(params, args, kV00), m_v01(params, args, kV01),
          m_v10(params, args, kV10), m_v11(params, args, kV11) {}
    Rgb rgb(const TextureQuery& q) const override {
        const V2f st = m_mapping.at(q).st;
        return (m_v00.rgb(q) * (1 - st.y) + m_v01.rgb(q) * st.y) * (1 - st.x) +
               (m_v10.rgb(q) * (1 - st.y) + m_v11.rgb(q) * st.y) * st.x;
    }
    bool needsFootprint() const override {
        return m_v00.needsFootprint() || m_v01.needsFootprint() || m_v10.needsFootprint() ||
               m_v11.needsFootprint();
    }

  private:
    Mapping2D m_mapping;
    Input m_v00, m_v01, m_v10, m_v11;
};

/// The fractional parts of the texture coordinates as red and green.
class UvColors final : public Texture {
  public:
    explicit UvColors(const Mapping2D& mapping) : m_mapping(mapping) {}
    Rgb rgb(const TextureQuery& q) const override {
        const V2f st = m_mapping.at(q).st;
        return {st.x - std::floor(st.x), st.y - std::floor(st.y), 0};
    }

  private:
    Mapping2D m_mapping;
};

/// A blend of two inputs with constant weights.
class Blend final : public Texture {
  public:
    Blend(Input a, Input b, float weightOfA) : m_a(std::move(a)), m_b(std::move(b)), m_weight(weightOfA) {}
    Rgb rgb(const TextureQuery& q) const override {
        return m_a.rgb(q) * m_weight + m_b.rgb(q) * (1 - m_weight);
    }
    bool needsFootprint() const override { return m_a.needsFootprint() || m_b.needsFootprint(); }
    bool isConstant() const override { return m_a.isConstant() && m_b.isConstant(); }

  private:
    Input m_a, m_b;
    float m_weight;
};

const InputDef kInside{"inside", 1, "value in the dots"}, kOutside{"outside", 0, "value around the dots"};
const InputDef kTex1{"tex1", 0, "value where the surface faces the direction"},
    kTex2{"tex2", 1, "value elsewhere"};
/// Mean coverage by dots: half of the cells have one, of radius 0.35.
constexpr float kDotCoverage = .5f * kPi * .35f * .35f;

using CreateTexture = std::function<TexturePtr(const ParamSet&, const BuildContext&, const TextureArgs&)>;

/// Returns the `create` of a constant texture that ignores its parameters.
CreateTexture constantTexture(const Rgb& c) {
    return [c](const ParamSet& params, const BuildContext&, const TextureArgs&) -> TexturePtr {
        params.markAllUsed();
        return std::make_shared<const Constant>(c);
    };
}

/// Returns the `create` of a blend of two inputs, which ignores all other parameters.
CreateTexture blendTexture(const InputDef& a, const InputDef& b, float weightOfA) {
    return [&a, &b, weightOfA](const ParamSet& params, const BuildContext&,
                               const TextureArgs& args) -> TexturePtr {
        auto texture =
            std::make_shared<const Blend>(Input(params, args, a), Input(params, args, b), weightOfA);
        params.markAllUsed();
        return texture;
    };
}

} // namespace

std::vector<CompatPlugin<TextureRow>> compatTextures() {
    const std::string mean = "a constant near its mean is used instead";
    std::vector<ParamInfo> corners{kV00.color, kV01.color, kV10.color, kV11.color};
    const std::vector<ParamInfo> mapping = mappingParams();
    corners.insert(corners.end(), mapping.begin(), mapping.end());
    return {
        {{"bilerp", "", corners,
          [](const ParamSet& params, const BuildContext& context, const TextureArgs& args) -> TexturePtr {
              return std::make_shared<const Bilerp>(params, context, args);
          }},
         ""},
        {{"uv", "", mapping,
          [](const ParamSet& params, const BuildContext& context, const TextureArgs& args) -> TexturePtr {
              return std::make_shared<const UvColors>(Mapping2D(params, context, args));
          }},
         ""},
        {{"dots", "", {kInside.color, kOutside.color}, blendTexture(kInside, kOutside, kDotCoverage)}, mean},
        {{"directionmix", "", {kTex1.color, kTex2.color}, blendTexture(kTex1, kTex2, .5f)}, mean},
        {{"fbm", "", {}, constantTexture(Rgb(0))}, mean},        // signed noise
        {{"wrinkled", "", {}, constantTexture(Rgb(.4f))}, mean}, // sum of the magnitudes of octaves
        {{"windy", "", {}, constantTexture(Rgb(0))}, mean},
        {{"marble", "", {}, constantTexture(Rgb(.45f, .45f, .5f))}, mean},
        {{"ptex", "", {}, constantTexture(Rgb(.5f))}, "a gray constant is used instead"},
    };
}

} // namespace strobe
