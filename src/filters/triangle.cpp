#include "filters/triangle.h"

#include "filters/separable.h"

namespace strobe {

namespace {

const WidthParams kWidths(2);

class TriangleFilter final : public Filter {
  public:
    explicit TriangleFilter(const V2f& radius) : m_radius(radius) {}
    V2f sample(const V2f& u) const override { return {tent(u.x) * m_radius.x, tent(u.y) * m_radius.y}; }
    float eval(const V2f& offset) const override {
        return tentPdf(offset.x / m_radius.x) * tentPdf(offset.y / m_radius.y) / (m_radius.x * m_radius.y);
    }
    V2f radius() const override { return m_radius; }

  private:
    V2f m_radius;
};

} // namespace

Plugin<std::shared_ptr<const Filter>> triangleFilterPlugin() {
    return {"triangle",
            "tent along each axis",
            {kWidths.x, kWidths.y},
            [](const ParamSet& params, const BuildContext&) {
                return std::make_shared<TriangleFilter>(kWidths.read(params));
            }};
}

} // namespace strobe
