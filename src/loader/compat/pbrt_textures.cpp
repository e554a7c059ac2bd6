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

using CreateTexture = std::function<TexturePtr(const ParamSet&, const BuildContext&, const TextureArgs&)>;

/// Returns the `create` of a constant texture that ignores its parameters.
CreateTexture constantTexture(const Rgb& c) {
    return [c](const ParamSet& params, const BuildContext&, const TextureArgs&) -> TexturePtr {
        params.markAllUsed();
        return std::make_shared<const Constant>(c);
    };
}

} // namespace

std::vector<CompatPlugin<TextureRow>> compatTextures() {
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
        {{"ptex", "", {}, constantTexture(Rgb(.5f))}, "a gray constant is used instead"},
    };
}

} // namespace strobe
