#include "filters/separable.h"

#include <algorithm>

namespace strobe {

namespace {

constexpr int kIntervals = 2048; ///< of the tabulated function
constexpr int kSteps = 4096;     ///< of the tabulated inverse of its distribution function
/// The probability of each end, where the inverse is not interpolated.
constexpr float kEndProbability = 1.f / 256;
bool isEnd(float u) { return u < kEndProbability || u > 1 - kEndProbability; }

/// The product of two profiles without negative lobes.
class PositiveFilter final : public Filter {
  public:
    PositiveFilter(Profile x, Profile y) : m_x(std::move(x)), m_y(std::move(y)) {}
    V2f sample(const V2f& u) const override {
        return {m_x.positive().sample(u.x), m_y.positive().sample(u.y)};
    }
    void sampleSoA(const V2SoA& u, int n, V2SoA& offset) const override {
        m_x.positive().sampleSoA(u.x, n, offset.x);
        m_y.positive().sampleSoA(u.y, n, offset.y);
    }
    float eval(const V2f& offset) const override { return m_x.eval(offset.x) * m_y.eval(offset.y); }
    V2f radius() const override { return {m_x.radius(), m_y.radius()}; }

  private:
    const Profile m_x, m_y;
};

/// The product of two profiles with negative lobes. It is positive where both or none are negative.
class SignedFilter final : public Filter {
  public:
    SignedFilter(Profile x, Profile y) : m_x(std::move(x)), m_y(std::move(y)) {}
    V2f sample(const V2f& u) const override {
        const float nx = m_x.negativeFraction(), ny = m_y.negativeFraction();
        const float both = (1 - nx) * (1 - ny), none = nx * ny, probability = both / (both + none);
        return u.x < probability || !(none > 0)
                   ? sampleParts(m_x.positive(), m_y.positive(), u.x / probability, u.y)
                   : sampleParts(m_x.negative(), m_y.negative(), (u.x - probability) / (1 - probability),
                                 u.y);
    }
    float negativeFraction() const override {
        const float nx = m_x.negativeFraction(), ny = m_y.negativeFraction();
        return nx * (1 - ny) + ny * (1 - nx);
    }
    V2f sampleNegative(const V2f& u) const override {
        const float nx = m_x.negativeFraction(), ny = m_y.negativeFraction();
        const float probability = nx * (1 - ny) / negativeFraction(); // that x is negative
        return u.x < probability ? sampleParts(m_x.negative(), m_y.positive(), u.x / probability, u.y)
                                 : sampleParts(m_x.positive(), m_y.negative(),
                                               (u.x - probability) / (1 - probability), u.y);
    }
    float eval(const V2f& offset) const override { return m_x.eval(offset.x) * m_y.eval(offset.y); }
    V2f radius() const override { return {m_x.radius(), m_y.radius()}; }

  private:
    static V2f sampleParts(const ProfilePart& x, const ProfilePart& y, float ux, float uy) {
        return {x.sample(std::min(ux, kOneMinusEpsilon)), y.sample(uy)};
    }
    const Profile m_x, m_y;
};

} // namespace

V2f WidthParams::read(const ParamSet& params) const { return {params.get(x), params.get(y)}; }

V2f WidthParams::read(const ParamSet& params, float fallback) const {
    return {params.has(x) ? params.get(x) : fallback, params.has(y) ? params.get(y) : fallback};
}

Profile::Profile(float radius, Function f) : m_radius(radius), m_f(std::move(f)) {
    const auto valueAt = [&](double fraction) { return m_f(float((2 * fraction - 1) * m_radius)); };
    std::vector<float> positive(kIntervals + 1), negative(kIntervals + 1);
    for (int i = 0; i <= kIntervals; ++i) {
        const float value = valueAt(double(i) / kIntervals);
        positive[size_t(i)] = std::max(value, 0.f);
        negative[size_t(i)] = std::max(-value, 0.f);
    }
    m_positive = ProfilePart(radius, positive);
    if (std::any_of(negative.begin(), negative.end(), [](float value) { return value > 0; })) {
        m_negative = ProfilePart(radius, negative);
        m_negativeFraction = m_negative.mean() / (m_positive.mean() + m_negative.mean());
    }
    double sum = 0;
    for (int i = 0; i < kIntervals; ++i)
        sum += double(valueAt((i + .5) / kIntervals));
    m_integral = float(sum * 2 * m_radius / kIntervals);
}

float Profile::eval(float x) const { return unnormalized(x) / m_integral; }

ProfilePart::ProfilePart(float radius, const std::vector<float>& nodes)
    : m_radius(radius), m_table(nodes), m_inverse(kSteps + 1) {
    for (int i = 0; i <= kSteps; ++i)
        m_inverse[size_t(i)] = exactInverse(float(i) / kSteps);
    m_inverse.front() = -m_radius;
    m_inverse.back() = m_radius;
}

namespace {

inline float lookupInverse(const float* inverse, float u) {
    const float scaled = u * kSteps;
    const int i = std::min(int(scaled), kSteps - 1);
    return lerp(inverse[i], inverse[i + 1], scaled - float(i));
}

STROBE_TARGET_CLONES void lookupInverses(const float* inverse, const float* u, int n, float* x) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        x[i] = lookupInverse(inverse, u[i]);
}

} // namespace

bool ProfilePart::isGap(float u) const {
    constexpr float kGap = 0.05f; // of the radius: more than any step of the table within a lobe
    const int i = std::min(int(u * kSteps), kSteps - 1);
    return m_inverse[size_t(i) + 1] - m_inverse[size_t(i)] > kGap * m_radius;
}

float ProfilePart::sample(float u) const {
    return isEnd(u) || isGap(u) ? exactInverse(u) : lookupInverse(m_inverse.data(), u);
}

void ProfilePart::sampleSoA(const float* u, int n, float* x) const {
    lookupInverses(m_inverse.data(), u, n, x);
    for (int i = 0; i < n; ++i)
        if (isEnd(u[i]))
            x[i] = exactInverse(u[i]);
}

std::shared_ptr<const Filter> makeSeparable(Profile x, Profile y) {
    if (x.hasNegativeLobes() || y.hasNegativeLobes())
        return std::make_shared<SignedFilter>(std::move(x), std::move(y));
    return std::make_shared<PositiveFilter>(std::move(x), std::move(y));
}

} // namespace strobe
