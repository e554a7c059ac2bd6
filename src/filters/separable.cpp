#include "filters/separable.h"

namespace strobe {

namespace {

constexpr int kIntervals = 512;

class SeparableFilter final : public Filter {
  public:
    SeparableFilter(Profile x, Profile y) : m_x(std::move(x)), m_y(std::move(y)) {}
    Sample sample(const V2f& u) const override {
        const Profile::Sample x = m_x.sample(u.x), y = m_y.sample(u.y);
        return {{x.x, y.x}, x.weight * y.weight};
    }
    float eval(const V2f& offset) const override { return m_x.eval(offset.x) * m_y.eval(offset.y); }
    V2f radius() const override { return {m_x.radius(), m_y.radius()}; }

  private:
    Profile m_x, m_y;
};

float checkedWidth(const ParamSet& params, const ParamDef<float>& def, float fallback) {
    const float width = params.has(def) ? params.get(def) : fallback;
    if (!(width > 0 && width <= 64))
        throw Error(params.whereIs(def), std::string("\"") + def.name + "\" must be above 0 and at most 64");
    return width;
}

} // namespace

V2f WidthParams::read(const ParamSet& params) const {
    return {checkedWidth(params, x, x.fallback), checkedWidth(params, y, y.fallback)};
}

V2f WidthParams::read(const ParamSet& params, float fallback) const {
    return {checkedWidth(params, x, fallback), checkedWidth(params, y, fallback)};
}

Profile::Profile(float radius, Function f) : m_radius(radius), m_f(std::move(f)) {
    const auto at = [&](double node) { return m_f(float((2 * node / kIntervals - 1) * m_radius)); };
    std::vector<float> nodes(kIntervals + 1);
    for (int i = 0; i <= kIntervals; ++i)
        nodes[i] = std::abs(at(i));
    m_absolute = PiecewiseLinear1D(nodes);
    m_negative.resize(kIntervals);
    // Signed and absolute integrals of the same table, so that the mean of the weights is exactly 1.
    double sum = 0, absolute = 0;
    for (int i = 0; i < kIntervals; ++i) {
        const double area = (double(nodes[i]) + nodes[i + 1]) / 2;
        m_negative[i] = at(i + .5) < 0;
        sum += m_negative[i] ? -area : area;
        absolute += area;
    }
    double integral = 0;
    constexpr int fine = 8 * kIntervals;
    for (int i = 0; i < fine; ++i)
        integral += m_f(float((2 * (i + .5) / fine - 1) * m_radius));
    m_integral = float(integral * 2 * m_radius / fine);
    m_weight = float(absolute / sum);
}

Profile::Sample Profile::sample(float u) const {
    const float t = m_absolute.sample(u);
    const bool negative = m_negative[size_t(t * kIntervals)];
    return {(2 * t - 1) * m_radius, negative ? -m_weight : m_weight};
}

float Profile::eval(float x) const { return raw(x) / m_integral; }

std::shared_ptr<const Filter> makeSeparable(Profile x, Profile y) {
    return std::make_shared<SeparableFilter>(std::move(x), std::move(y));
}

} // namespace strobe
