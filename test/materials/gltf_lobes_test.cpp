// Tests of the sheen and of the thin film of the metallic-roughness material.
#include "core/color/spectrum.h"
#include "materials/fresnel.h"
#include "materials/sheen.h"
#include "materials/thin_film.h"

#include <gtest/gtest.h>

namespace strobe::test {
namespace {

TEST(Sheen, TheTableIsTheAlbedoOfTheBrdf) {
    constexpr int kSteps = 300;
    for (const float roughness : {.3f, .5f, .8f, 1.f})
        for (const float cosO : {.4f, .7f, 1.f}) {
            double sum = 0;
            const double sinO = std::sqrt(1 - cosO * cosO);
            for (int i = 0; i < kSteps; ++i)
                for (int j = 0; j < kSteps; ++j) {
                    const double cosI = (i + .5) / kSteps, phi = (j + .5) / kSteps * M_PI;
                    const double sinI = std::sqrt(1 - cosI * cosI);
                    const V3f half(float(sinO + sinI * std::cos(phi)), float(sinI * std::sin(phi)),
                                   float(cosO + cosI));
                    sum += sheenBrdf(cosO, float(cosI), half.z / length(half), roughness) * cosI;
                }
            EXPECT_NEAR(sum / (kSteps * kSteps) * 2 * M_PI, sheenAlbedo(cosO, roughness), .02)
                << roughness << " " << cosO;
        }
}

TEST(Sheen, AlbedoIsAtMostOne) {
    for (float roughness = 0; roughness <= 1; roughness += .1f)
        for (float cosine = 0; cosine <= 1; cosine += .1f) {
            EXPECT_GE(sheenAlbedo(cosine, roughness), 0);
            EXPECT_LE(sheenAlbedo(cosine, roughness), 1);
        }
}

/// The reflectance of a film on a base by the Airy formula, summed over wavelengths.
Rgb exactFilm(float cosine, float index, float thickness, float f0) {
    std::vector<float> wavelengths, values, ones;
    const double root = std::sqrt(f0), base = (1 + root) / (1 - root);
    const double cosFilm = std::sqrt(1 - (1 - cosine * cosine) / (index * index));
    const double r12 = -std::sqrt(fresnelDielectric(cosine, 1, index));
    const double inner0 = std::pow((base - index) / (base + index), 2);
    const double inner = inner0 + (1 - inner0) * std::pow(1 - cosFilm, 5);
    const double r23 = std::sqrt(inner) * (base > index ? -1 : 1);
    for (float nm = 360; nm <= 830; nm += 1) {
        const double phase = std::cos(2 * M_PI * 2 * index * thickness * cosFilm / nm), p = r12 * r23;
        wavelengths.push_back(nm);
        ones.push_back(1);
        values.push_back(float((r12 * r12 + r23 * r23 + 2 * p * phase) / (1 + p * p + 2 * p * phase)));
    }
    return spectrumToRgb(wavelengths, values) / spectrumToRgb(wavelengths, ones);
}

TEST(ThinFilm, EqualsTheSumOverWavelengths) {
    for (const float cosine : {1.f, .7f, .4f})
        for (const float thickness : {120.f, 300.f, 550.f, 1000.f})
            for (const float f0 : {.04f, .3f, .8f}) {
                const Rgb film = thinFilmReflectance(cosine, 1.5f, thickness, Rgb(f0));
                const Rgb exact = exactFilm(cosine, 1.5f, thickness, f0);
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(film[c], std::clamp(exact[c], 0.f, 1.f), .012f)
                        << cosine << " " << thickness << " " << f0 << " channel " << c;
            }
}

TEST(ThinFilm, WithoutThicknessOrContrastThereIsNoColor) {
    const Rgb thin = thinFilmReflectance(.8f, 1.4f, 0, Rgb(.04f));
    EXPECT_NEAR(thin.x, thin.z, 1e-3f);
    EXPECT_NEAR(thin.y, .04f, 2e-3f);
    const Rgb air = thinFilmReflectance(1, 1, 500, Rgb(.3f, .5f, .7f));
    EXPECT_NEAR(air.x, .3f, 1e-3f);
    EXPECT_NEAR(air.z, .7f, 1e-3f);
}

} // namespace
} // namespace strobe::test
