#include "filters/separable.h"

namespace strobe {

namespace {

/// Of the function, and of the inverse of its integral.
constexpr int kIntervals = 2048, kSteps = 4096;
/// How much of the distribution is an end.
constexpr float kEnd = 1.f / 256;
bool isEnd(float u) { return u < kEnd || u > 1 - kEnd; }

class SeparableFilter final : public Filter {
  public:
    SeparableFilter(Profile x, Profile y) : m_x(std::move(x)), m_y(std::move(y)) {}
    Sample sample(const V2f& u) const override {
        const Profile::Sample x = m_x.sample(u.x), y = m_y.sample(u.y);
        return {{x.x, y.x}, x.weight * y.weight};
    }
    void sampleSoA(const V2SoA& u, int n, V2SoA& offset, float* weight) const override {
        float wx[kSoAWidth], wy[kSoAWidth];
        m_x.sampleSoA(u.x, n, offset.x, wx);
        m_y.sampleSoA(u.y, n, offset.y, wy);
        for (int i = 0; i < n; ++i)
            weight[i] = wx[i] * wy[i];
    }
    float eval(const V2f& offset) const override { return m_x.eval(offset.x) * m_y.eval(offset.y); }
    V2f radius() const override { return {m_x.radius(), m_y.radius()}; }

  private:
    Profile m_x, m_y;
};

} // namespace

V2f WidthParams::read(const ParamSet& params) const { return {params.get(x), params.get(y)}; }

V2f WidthParams::read(const ParamSet& params, float fallback) const {
    return {params.has(x) ? params.get(x) : fallback, params.has(y) ? params.get(y) : fallback};
}

Profile::Profile(float radius, Function f) : m_radius(radius), m_f(std::move(f)) {
    const auto at = [&](double fraction) { return m_f(float((2 * fraction - 1) * m_radius)); };
    std::vector<float> nodes(kIntervals + 1);
    for (int i = 0; i <= kIntervals; ++i)
        nodes[size_t(i)] = std::abs(at(double(i) / kIntervals));
    m_absolute = PiecewiseLinear1D(nodes);
    m_inverse.resize(kSteps + 1);
    for (int i = 0; i <= kSteps; ++i)
        m_inverse[size_t(i)] = exact(float(i) / kSteps);
    m_inverse.front() = -m_radius;
    m_inverse.back() = m_radius;
    // Weights from what the table really does, so that their mean is 1.
    std::vector<float> signs(kIntervals);
    double sum = 0, integral = 0;
    for (int i = 0; i < kIntervals; ++i) {
        const float value = at((i + .5) / kIntervals), width = 2 * m_radius / kIntervals;
        const float from = float(i) * width - m_radius;
        signs[size_t(i)] = value < 0 ? -1.f : 1.f;
        sum += double(signs[size_t(i)]) * (distribution(from + width) - distribution(from));
        integral += value;
    }
    m_integral = float(integral * 2 * m_radius / kIntervals);
    m_weight = float(1 / sum);
    if (std::find(signs.begin(), signs.end(), -1.f) != signs.end())
        for (float sign : signs)
            m_signed.push_back(sign * m_weight);
}

float Profile::distribution(float x) const {
    if (const float u = m_absolute.inverse((x / m_radius + 1) / 2); isEnd(u))
        return u;
    const auto above = std::upper_bound(m_inverse.begin(), m_inverse.end(), x);
    if (above == m_inverse.begin() || above == m_inverse.end())
        return above == m_inverse.end();
    const auto below = above - 1;
    return (float(below - m_inverse.begin()) + (x - *below) / (*above - *below)) / kSteps;
}

namespace {

inline float lookUp(const float* inverse, float u) {
    const float scaled = u * kSteps;
    const int i = std::min(int(scaled), kSteps - 1);
    return lerp(inverse[i], inverse[i + 1], scaled - float(i));
}
inline float signedWeight(const float* weights, float radius, float x) {
    return weights[std::min(int((x / radius + 1) * (.5f * kIntervals)), kIntervals - 1)];
}

STROBE_TARGET_CLONES void lookUpAll(const float* inverse, const float* u, int n, float* x) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        x[i] = lookUp(inverse, u[i]);
}
STROBE_TARGET_CLONES void weighAll(const float* weights, float radius, const float* x, int n, float* weight) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        weight[i] = signedWeight(weights, radius, x[i]);
}

} // namespace

Profile::Sample Profile::sample(float u) const {
    const float x = isEnd(u) ? exact(u) : lookUp(m_inverse.data(), u);
    return {x, m_signed.empty() ? m_weight : signedWeight(m_signed.data(), m_radius, x)};
}

void Profile::sampleSoA(const float* u, int n, float* x, float* weight) const {
    lookUpAll(m_inverse.data(), u, n, x);
    for (int i = 0; i < n; ++i)
        if (isEnd(u[i]))
            x[i] = exact(u[i]);
    if (m_signed.empty())
        std::fill_n(weight, n, m_weight);
    else
        weighAll(m_signed.data(), m_radius, x, n, weight);
}

float Profile::eval(float x) const { return raw(x) / m_integral; }

std::shared_ptr<const Filter> makeSeparable(Profile x, Profile y) {
    return std::make_shared<SeparableFilter>(std::move(x), std::move(y));
}

} // namespace strobe
