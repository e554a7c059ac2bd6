#include "textures/checkerboard.h"

#include "textures/inputs.h"

namespace strobe {
namespace {

const InputDef kTex1{"tex1", 1, "value of the squares where floor(s) + floor(t) is even"};
const InputDef kTex2{"tex2", 0, "value of the other squares"};
const ParamDef<int> kDimension{"dimension", 2, "2: squares; 3: cubes in texture space, not filtered"};
const ParamDef<std::string> kAaMode{"aamode", "closedform",
                                    "antialiasing: none, or closedform (box filter over the footprint)"};

/// Returns the mean over [x - half, x + half] of the square wave that is +1 where floor(x) is even, else -1.
float squareWaveMean(float x, float half) {
    const auto wrapped = [](float a) { return a - 2 * std::floor(a / 2); };
    // The integral is the triangle wave 1 - |1 - (x mod 2)|. For half widths below 1e-4, its differences are
    // dominated by rounding.
    if (half < 1e-4f)
        return wrapped(x) < 1 ? 1.f : -1.f;
    const auto integral = [&](float a) { return 1 - std::abs(1 - wrapped(a)); };
    return (integral(x + half) - integral(x - half)) / (2 * half);
}

class Checkerboard : public Texture {
  public:
    Checkerboard(Input a, Input b, const Mapping2D& mapping, bool isFiltered)
        : m_a(std::move(a)), m_b(std::move(b)), m_mapping(mapping),
          m_isFiltered(isFiltered && !m_a.equals(m_b)) {}

    Rgb rgb(const TextureQuery& q) const override {
        const float w = tex2Fraction(q);
        if (w == 0 || w == 1)
            return w == 0 ? m_a.rgb(q) : m_b.rgb(q);
        return m_a.rgb(q) * (1 - w) + m_b.rgb(q) * w;
    }
    float value(const TextureQuery& q) const override {
        const float w = tex2Fraction(q);
        if (w == 0 || w == 1)
            return w == 0 ? m_a.value(q) : m_b.value(q);
        return lerp(m_a.value(q), m_b.value(q), w);
    }
    bool needsFootprint() const override {
        return m_isFiltered || m_a.needsFootprint() || m_b.needsFootprint();
    }
    bool isConstant() const override { return m_a.equals(m_b); }

  private:
    /// Returns the fraction of the bounding box of the footprint, in [0,1], that tex2 covers.
    float tex2Fraction(const TextureQuery& q) const {
        const TexturePoint point = m_mapping.at(q);
        const auto halfWidth = [&](int axis) {
            return m_isFiltered ? (std::abs(point.dstdx[axis]) + std::abs(point.dstdy[axis])) / 2 : 0.f;
        };
        const float even =
            squareWaveMean(point.st.x, halfWidth(0)) * squareWaveMean(point.st.y, halfWidth(1));
        return std::clamp((1 - even) / 2, 0.f, 1.f);
    }

    Input m_a, m_b;
    Mapping2D m_mapping;
    bool m_isFiltered;
};

class Checkerboard3D : public Texture {
  public:
    Checkerboard3D(Input a, Input b, const Mapping3D& mapping)
        : m_a(std::move(a)), m_b(std::move(b)), m_mapping(mapping) {}
    Rgb rgb(const TextureQuery& q) const override { return (isOdd(q) ? m_b : m_a).rgb(q); }
    float value(const TextureQuery& q) const override { return (isOdd(q) ? m_b : m_a).value(q); }
    bool needsFootprint() const override { return m_a.needsFootprint() || m_b.needsFootprint(); }
    bool isConstant() const override { return m_a.equals(m_b); }

  private:
    bool isOdd(const TextureQuery& q) const {
        const V3f p = m_mapping.point(q);
        return std::fmod(std::floor(p.x) + std::floor(p.y) + std::floor(p.z), 2.f) != 0;
    }
    Input m_a, m_b;
    Mapping3D m_mapping;
};

TexturePtr create(const ParamSet& params, const BuildContext& context, const TextureArgs& args) {
    Input a(params, args, kTex1), b(params, args, kTex2);
    const int dimension = params.get(kDimension);
    if (dimension != 2 && dimension != 3)
        throw Error(params.whereIs(kDimension), "\"dimension\" must be 2 or 3");
    const bool isFiltered =
        parseWord<bool>(params, kAaMode, {{"none", false}, {"closedform", true}, {"supersample", true}});
    const Mapping2D mapping(params, context, args);
    if (dimension == 3)
        return std::make_shared<const Checkerboard3D>(std::move(a), std::move(b), Mapping3D(context, args));
    return std::make_shared<const Checkerboard>(std::move(a), std::move(b), mapping, isFiltered);
}

} // namespace

Plugin<TexturePtr, const TextureArgs&> checkerboardTexturePlugin() {
    std::vector<ParamInfo> table{kTex1.color, kTex2.color, kDimension, kAaMode};
    const std::vector<ParamInfo> mapping = mappingParams();
    table.insert(table.end(), mapping.begin(), mapping.end());
    return {"checkerboard", "squares or cubes of two textures; squares are filtered in closed form", table,
            create};
}

} // namespace strobe
