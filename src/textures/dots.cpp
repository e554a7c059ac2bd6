#include "textures/dots.h"

#include "textures/inputs.h"
#include "textures/noise.h"

namespace strobe {
namespace {

const InputDef kInside{"inside", 1, "value in the dots"}, kOutside{"outside", 0, "value around the dots"};

float noise2D(float x, float y) { return noise(V3f(x, y, .5f)); }

bool isInDot(const V2f& st) {
    constexpr float kRadius = .35f, kMaxShift = .5f - kRadius;
    const V2f cell(std::floor(st.x + .5f), std::floor(st.y + .5f));
    if (!(noise2D(cell.x + .5f, cell.y + .5f) > 0))
        return false;
    const V2f shift(noise2D(cell.x + 1.5f, cell.y + 2.8f), noise2D(cell.x + 4.5f, cell.y + 9.8f));
    const V2f d = st - cell - shift * kMaxShift;
    return sqr(d.x) + sqr(d.y) < sqr(kRadius);
}

class Dots final : public Texture {
  public:
    Dots(Input inside, Input outside, const Mapping2D& mapping)
        : m_inside(std::move(inside)), m_outside(std::move(outside)), m_mapping(mapping) {}
    Rgb rgb(const TextureQuery& q) const override { return inputAt(q).rgb(q); }
    float value(const TextureQuery& q) const override { return inputAt(q).value(q); }
    bool needsFootprint() const override { return m_inside.needsFootprint() || m_outside.needsFootprint(); }
    bool isConstant() const override { return m_inside.equals(m_outside); }

  private:
    const Input& inputAt(const TextureQuery& q) const {
        return isInDot(m_mapping.at(q).st) ? m_inside : m_outside;
    }
    Input m_inside, m_outside;
    Mapping2D m_mapping;
};

} // namespace

Plugin<TexturePtr, const TextureArgs&> dotsTexturePlugin() {
    std::vector<ParamInfo> table{kInside.color, kOutside.color};
    const std::vector<ParamInfo> mapping = mappingParams();
    table.insert(table.end(), mapping.begin(), mapping.end());
    return {"dots", "dots of one input on another", table,
            [](const ParamSet& params, const BuildContext& context, const TextureArgs& args) -> TexturePtr {
                Input inside(params, args, kInside), outside(params, args, kOutside);
                if (context.isLenient) // all versions of pbrt confuse the two
                    std::swap(inside, outside);
                return std::make_shared<const Dots>(std::move(inside), std::move(outside),
                                                    Mapping2D(params, context, args));
            }};
}

} // namespace strobe
