#include "filters/box.h"

#include "filters/separable.h"

namespace strobe {

namespace {

const WidthParams kWidths(0.5f);

STROBE_TARGET_CLONES void sampleBox(const V2f& radius, const V2SoA& u, int n, V2SoA& offset) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        offset.x[i] = (2 * u.x[i] - 1) * radius.x;
        offset.y[i] = (2 * u.y[i] - 1) * radius.y;
    }
}

class BoxFilter final : public Filter {
  public:
    explicit BoxFilter(const V2f& radius) : m_radius(radius) {}
    V2f sample(const V2f& u) const override {
        return {(2 * u.x - 1) * m_radius.x, (2 * u.y - 1) * m_radius.y};
    }
    void sampleSoA(const V2SoA& u, int n, V2SoA& offset) const override { sampleBox(m_radius, u, n, offset); }
    float eval(const V2f& offset) const override {
        const bool isInside = std::abs(offset.x) <= m_radius.x && std::abs(offset.y) <= m_radius.y;
        return isInside ? 1 / (4 * m_radius.x * m_radius.y) : 0;
    }
    V2f radius() const override { return m_radius; }

  private:
    V2f m_radius;
};

} // namespace

Plugin<std::shared_ptr<const Filter>> boxFilterPlugin() {
    return {"box",
            "constant over a rectangle",
            {kWidths.x, kWidths.y},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<BoxFilter>(kWidths.read(params));
            }};
}

} // namespace strobe
