#include "materials/thin_film.h"

#include "core/color/spectrum.h"
#include "materials/fresnel.h"

#include <vector>

namespace strobe {
namespace {

/// The means over the visible wavelengths of cos(2π path / λ), by channel, as functions of the optical path.
class MeanCosines {
  public:
    MeanCosines() {
        std::vector<float> wavelengths, ones, cosines;
        for (float nm = 360; nm <= 830; nm += 2) {
            wavelengths.push_back(nm);
            ones.push_back(1);
        }
        cosines.resize(wavelengths.size());
        const Rgb white = spectrumToRgb(wavelengths, ones);
        for (int i = 0; i < kCount; ++i) {
            for (size_t k = 0; k < wavelengths.size(); ++k)
                cosines[k] = std::cos(2 * kPi * (float(i) * kStep) / wavelengths[k]);
            m_means.push_back(spectrumToRgb(wavelengths, cosines) / white);
        }
    }
    /// `path`: in nm. Long paths average to 0.
    Rgb at(float path) const {
        const float x = path / kStep;
        const auto i = int(std::min(x, float(kCount)));
        if (i >= kCount - 1)
            return Rgb(0);
        const float t = x - float(i);
        return m_means[size_t(i)] * (1 - t) + m_means[size_t(i) + 1] * t;
    }

  private:
    static constexpr int kCount = 1000;
    static constexpr float kStep = 10; ///< nm
    std::vector<Rgb> m_means;
};

const MeanCosines& meanCosines() {
    static const MeanCosines means;
    return means;
}

float schlickFrom(float f0, float cosine) {
    const float x = 1 - std::min(cosine, 1.f), x2 = x * x;
    return f0 + (1 - f0) * x2 * x2 * x;
}

} // namespace

Rgb thinFilmReflectance(float cosine, float index, float thickness, const Rgb& f0) {
    constexpr int kOrders = 3;
    constexpr float kFade = 30; // nm: thinner films become part of the air
    const float film = 1 + (index - 1) * std::min(thickness / kFade, 1.f);
    const float cosFilm = safeSqrt(1 - (1 - sqr(cosine)) / sqr(film));
    const float outer = fresnelDielectric(cosine, 1, film);
    const float path = 2 * film * thickness * cosFilm;
    Rgb mean[kOrders];
    for (int m = 0; m < kOrders; ++m)
        mean[m] = meanCosines().at(float(m + 1) * path);
    Rgb out;
    for (int c = 0; c < 3; ++c) {
        const float root = std::sqrt(std::clamp(f0[c], 0.f, .9999f));
        const float base = (1 + root) / (1 - root); // the index that has this reflectance in air
        const float inner = schlickFrom(sqr((base - film) / (base + film)), cosFilm);
        // The product of the amplitudes: light that reaches a denser medium is reflected with a phase of π.
        const float product = std::sqrt(outer * inner) * (base < film ? -1.f : 1.f);
        // |r|² = 1 - (1 - outer)(1 - inner) / (1 + product² + 2 product cos δ), as a series in cos(m δ).
        float series = 1, power = 1;
        for (int m = 0; m < kOrders; ++m) {
            power *= -product;
            series += 2 * power * mean[m][c];
        }
        const float reflectance = 1 - (1 - outer) * (1 - inner) / (1 - sqr(product)) * series;
        out[c] = std::clamp(reflectance, 0.f, 1.f);
    }
    return out;
}

} // namespace strobe
