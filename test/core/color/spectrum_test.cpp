#include "core/color/spectrum.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace strobe {
namespace {

void expectNear(const Rgb& a, const Rgb& b, float relative) {
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(a[c], b[c], relative * std::abs(b[c])) << a;
}

TEST(Spectrum, ConstantSpectrumHasTheColorOfPbrt) {
    const std::array<float, 1> nm{500}, one{1};
    expectNear(spectrumToRgb(nm, one), Rgb(1.20489f, .94823f, .90927f), 1e-4f);
}

TEST(Spectrum, IsInterpolatedLinearlyAndConstantBeyondTheEnds) {
    const std::array<float, 2> nm{400, 700}, ramp{0, 3};
    const std::array<float, 5> dense{300, 400, 550, 700, 900}, same{0, 0, 1.5f, 3, 3};
    expectNear(spectrumToRgb(nm, ramp), spectrumToRgb(dense, same), 1e-5f);
    const std::array<float, 2> twice{0, 6};
    expectNear(spectrumToRgb(nm, twice), spectrumToRgb(nm, ramp) * 2, 1e-5f);
    EXPECT_GT(spectrumToRgb(nm, ramp).x, spectrumToRgb(nm, ramp).z); // the spectrum increases towards red
}

TEST(Spectrum, NarrowLinesAreBlueGreenAndRed) {
    // A narrow line has the color of the color matching functions at its wavelength.
    const std::array<float, 3> lines{450, 540, 620};
    for (int k = 0; k < 3; ++k) {
        const float l = lines[size_t(k)];
        const std::array<float, 3> nm{l - 5, l, l + 5}, value{0, 1, 0};
        const Rgb c = spectrumToRgb(nm, value);
        EXPECT_EQ(maxComponent(c), c[2 - k]) << l;
    }
}

TEST(Spectrum, ArraysOfDifferentSizeAreAnError) {
    const std::array<float, 2> nm{400, 700};
    const std::array<float, 1> one{1};
    EXPECT_THROW(spectrumToRgb(nm, one), Error);
    EXPECT_THROW(spectrumToRgb({}, {}), Error);
}

TEST(Spectrum, BlackbodiesAreNormalizedToTheirMaximum) {
    // At 5270 K, the maximum is at 550 nm, near the maximum of ȳ, so the luminance is nearly 1.
    EXPECT_NEAR(luminance(blackbodyRgb(5270, 1)), .96f, .03f);
    expectNear(blackbodyRgb(4000, 3), blackbodyRgb(4000, 1) * 3, 1e-6f);
    const Rgb warm = blackbodyRgb(2700, 1), cold = blackbodyRgb(10000, 1);
    EXPECT_GT(warm.x, 2 * warm.z);
    EXPECT_GT(cold.z, cold.x);
    EXPECT_EQ(blackbodyRgb(0, 1), Rgb(0));
}

TEST(Spectrum, BlackbodiesMatchPlancksLaw) {
    const float t = 3000;
    std::vector<float> nm, value;
    double greatest = 0;
    for (int l = 300; l <= 4000; ++l) {
        const double m = l * 1e-9;
        const double b =
            1 / (std::pow(m, 5) * std::expm1(6.62607015e-34 * 299792458 / (m * 1.380649e-23 * t)));
        nm.push_back(float(l));
        value.push_back(float(b * 1e-30));
        greatest = std::max(greatest, b * 1e-30);
    }
    for (float& v : value)
        v /= float(greatest);
    expectNear(blackbodyRgb(t, 1), spectrumToRgb(nm, value), 1e-4f);
}

TEST(Spectrum, NamedSpectraHaveKnownValues) {
    ASSERT_TRUE(namedSpectrum("metal-Cu-eta"));
    expectNear(*namedSpectrum("metal-Cu-k"), Rgb(3.2476f, 2.5868f, 2.3560f), 1e-4f);
    expectNear(*namedSpectrum("glass-BK7"), Rgb(1.5168f), 1e-5f);
    EXPECT_FALSE(namedSpectrum("metal-Xx-eta"));
    expectNear(*namedSpectrum("stdillum-D65"), Rgb(1), 1e-3f);
    const Rgb a = *namedSpectrum("stdillum-A");
    EXPECT_NEAR(luminance(a), 1, 2e-3f);
    EXPECT_GT(a.x, 2 * a.z);
    EXPECT_FALSE(namedSpectrum("stdillum-F13"));
    EXPECT_NEAR(luminance(*namedSpectrum("illum-acesD60")), 1, 2e-3f);
    const Rgb brass = *namedSpectrum("metal-CuZn-k");
    EXPECT_TRUE(brass.x > brass.y && brass.y > brass.z);
    EXPECT_NEAR(namedSpectrum("metal-MgO-eta")->y, 1.741f, 1e-3f);
    EXPECT_NEAR(namedSpectrum("metal-TiO2-eta")->y, 2.955f, 1e-3f);
}

class SpdFile : public testing::Test {
  protected:
    Rgb read(const std::string& text) {
        std::ofstream(m_path) << text;
        return readSpd(m_path, {});
    }
    std::string errorOf(const std::string& text) {
        try {
            read(text);
        } catch (const Error& e) {
            return e.what();
        }
        return "no error";
    }
    void TearDown() override { std::filesystem::remove(m_path); }
    std::filesystem::path m_path =
        std::filesystem::temp_directory_path() / ("strobe-" + std::to_string(::getpid()) + ".spd");
};

TEST_F(SpdFile, ReadsPairsAndComments) {
    const std::array<float, 2> nm{400, 700}, value{.5f, 1};
    expectNear(read("# a comment\n400 .5\n\n  700\t1.0 # the end\r\n"), spectrumToRgb(nm, value), 1e-6f);
}

TEST_F(SpdFile, MalformedFilesAreErrors) {
    EXPECT_NE(errorOf("400 1\n500\n").find(":2: expected a wavelength and a value"), std::string::npos);
    EXPECT_NE(errorOf("400 1\n500 x\n").find(":2: not a number"), std::string::npos);
    EXPECT_NE(errorOf("400 1x\n").find(":1: not a number"), std::string::npos);
    EXPECT_NE(errorOf("400 nan\n").find(":1: not a number"), std::string::npos);
    EXPECT_NE(errorOf("500 1\n400 1\n").find(":2: wavelengths must ascend"), std::string::npos);
    EXPECT_NE(errorOf("# nothing\n").find("no samples"), std::string::npos);
    EXPECT_THROW(readSpd("/nonexistent/x.spd", {}), Error);
}

} // namespace
} // namespace strobe
