#include "filters/separable.h"

namespace strobe {

namespace {

constexpr int kIntervals = 2048; ///< of the tabulated function
constexpr int kSteps = 4096;     ///< of the tabulated inverse of its distribution function
/// The probability of each end, where the inverse is not interpolated.
constexpr float kEndProbability = 1.f / 256;
bool isEnd(float u) { return u < kEndProbability || u > 1 - kEndProbability; }

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
    const auto valueAt = [&](double fraction) { return m_f(float((2 * fraction - 1) * m_radius)); };
    std::vector<float> nodes(kIntervals + 1);
    for (int i = 0; i <= kIntervals; ++i)
        nodes[size_t(i)] = std::abs(valueAt(double(i) / kIntervals));
    m_absolute = PiecewiseLinear1D(nodes);
    m_inverse.resize(kSteps + 1);
    for (int i = 0; i <= kSteps; ++i)
        m_inverse[size_t(i)] = exactInverse(float(i) / kSteps);
    m_inverse.front() = -m_radius;
    m_inverse.back() = m_radius;
    // The weight is computed from the distribution of the table, so that the mean weight is 1.
    std::vector<float> signs(kIntervals);
    double sum = 0, integral = 0;
    for (int i = 0; i < kIntervals; ++i) {
        const float value = valueAt((i + .5) / kIntervals), width = 2 * m_radius / kIntervals;
        const float from = float(i) * width - m_radius;
        signs[size_t(i)] = value < 0 ? -1.f : 1.f;
        sum += double(signs[size_t(i)]) * (distribution(from + width) - distribution(from));
        integral += value;
    }
    m_integral = float(integral * 2 * m_radius / kIntervals);
    m_weight = float(1 / sum);
    if (std::find(signs.begin(), signs.end(), -1.f) != signs.end())
        for (float sign : signs)
            m_signedWeights.push_back(sign * m_weight);
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

inline float lookupInverse(const float* inverse, float u) {
    const float scaled = u * kSteps;
    const int i = std::min(int(scaled), kSteps - 1);
    return lerp(inverse[i], inverse[i + 1], scaled - float(i));
}
inline float signedWeight(const float* weights, float radius, float x) {
    return weights[std::min(int((x / radius + 1) * (.5f * kIntervals)), kIntervals - 1)];
}

STROBE_TARGET_CLONES void lookupInverses(const float* inverse, const float* u, int n, float* x) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        x[i] = lookupInverse(inverse, u[i]);
}
STROBE_TARGET_CLONES void lookupWeights(const float* weights, float radius, const float* x, int n,
                                        float* weight) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        weight[i] = signedWeight(weights, radius, x[i]);
}

} // namespace

Profile::Sample Profile::sample(float u) const {
    const float x = isEnd(u) ? exactInverse(u) : lookupInverse(m_inverse.data(), u);
    return {x, m_signedWeights.empty() ? m_weight : signedWeight(m_signedWeights.data(), m_radius, x)};
}

void Profile::sampleSoA(const float* u, int n, float* x, float* weight) const {
    lookupInverses(m_inverse.data(), u, n, x);
    for (int i = 0; i < n; ++i)
        if (isEnd(u[i]))
            x[i] = exactInverse(u[i]);
    if (m_signedWeights.empty())
        std::fill_n(weight, n, m_weight);
    else
        lookupWeights(m_signedWeights.data(), m_radius, x, n, weight);
}

float Profile::eval(float x) const { return unnormalized(x) / m_integral; }

std::shared_ptr<const Filter> makeSeparable(Profile x, Profile y) {
    return std::make_shared<SeparableFilter>(std::move(x), std::move(y));
}

} // namespace strobe
