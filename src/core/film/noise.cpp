#include "core/film/noise.h"

namespace strobe {

namespace {

/// Returns P(|T| < t), by the finite sums of Abramowitz and Stegun, 26.7.3 and 26.7.4.
double studentProbability(double t, int dof) {
    const double angle = std::atan(t / std::sqrt(double(dof)));
    const double cosine = std::cos(angle), sine = std::sin(angle);
    const bool isOdd = dof % 2 != 0;
    double term = isOdd ? cosine : 1;
    double sum = dof > 1 ? term : 0;
    for (int k = isOdd ? 3 : 2; k < dof; k += 2) {
        term *= cosine * cosine * (k - 1) / k;
        sum += term;
    }
    return isOdd ? 2 / M_PI * (angle + sine * sum) : sine * sum;
}

/// Returns the noise that NoiseEstimate::kPixelFraction of the pixels do not exceed.
double levelOf(std::vector<float> noise) {
    if (noise.empty())
        return kInfinity;
    const auto count = size_t(std::ceil(NoiseEstimate::kPixelFraction * double(noise.size())));
    const auto rank = noise.begin() + ptrdiff_t(std::min(count, noise.size()) - 1);
    std::nth_element(noise.begin(), rank, noise.end());
    return *rank;
}

} // namespace

double studentQuantile(double probability, int dof) {
    double low = 0, high = 1;
    while (studentProbability(high, dof) < probability)
        high *= 2;
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        (studentProbability(middle, dof) < probability ? low : high) = middle;
    }
    return low;
}

void NoiseEstimate::add(const Image& pass) {
    if (m_passes++ == 0) {
        m_width = pass.width;
        m_height = pass.height;
        m_mean.assign(pass.pixels.size(), 0.f);
        m_squaredDeviations.assign(pass.pixels.size(), 0.f);
    }
    for (size_t i = 0; i < m_mean.size(); ++i) { // Welford's algorithm
        const float y = luminance(pass.pixels[i]);
        const float deviation = y - m_mean[i];
        m_mean[i] += deviation / float(m_passes);
        m_squaredDeviations[i] += deviation * (y - m_mean[i]);
    }
}

std::vector<float> NoiseEstimate::pixels() const {
    std::vector<float> noise(m_mean.size(), kInfinity);
    if (m_passes < 2)
        return noise;
    const double t = studentQuantile(kConfidence, m_passes - 1);
    const double scale = t / std::sqrt(double(m_passes - 1) * m_passes);
    for (int y = 0; y < m_height; ++y) {
        for (int x = 0; x < m_width; ++x) {
            float sum = 0;
            int count = 0;
            for (int j = std::max(y - 1, 0); j <= std::min(y + 1, m_height - 1); ++j) {
                for (int i = std::max(x - 1, 0); i <= std::min(x + 1, m_width - 1); ++i) {
                    sum += m_squaredDeviations[size_t(j) * size_t(m_width) + size_t(i)];
                    ++count;
                }
            }
            const size_t pixel = size_t(y) * size_t(m_width) + size_t(x);
            const double squares = std::max(m_squaredDeviations[pixel], sum / float(count));
            noise[pixel] = float(scale * std::sqrt(squares)) / std::max(m_mean[pixel], kFloor);
        }
    }
    return noise;
}

std::vector<float> NoiseEstimate::variances() const {
    std::vector<float> variances(m_squaredDeviations.size(), kInfinity);
    if (m_passes > 1) {
        for (size_t i = 0; i < variances.size(); ++i)
            variances[i] = m_squaredDeviations[i] / (float(m_passes) * float(m_passes - 1));
    }
    return variances;
}

double NoiseEstimate::level() const { return levelOf(pixels()); }

double noiseLevel(const Image& image, std::span<const float> errors) {
    constexpr float kQuantile = 1.96f; // of the normal distribution, for NoiseEstimate::kConfidence
    std::vector<float> noise(errors.begin(), errors.end());
    for (size_t i = 0; i < noise.size(); ++i)
        noise[i] *= kQuantile / std::max(luminance(image.pixels[i]), NoiseEstimate::kFloor);
    return levelOf(std::move(noise));
}

} // namespace strobe
