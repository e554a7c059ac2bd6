// Small versions of the sweeps of scenes/stress, with bounds of the errors of the sharing integrators. A
// change that increases an error fails here; one that decreases an error should lower the bounds.
#include "support/render_text.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numeric>
#include <regex>
#include <sstream>

namespace strobe {
namespace {

constexpr int kSeeds = 16;
constexpr int kWidth = 32, kHeight = 24, kTile = 8;
constexpr int kSamples = 16, kReferenceSamples = 256, kReferences = 4;

/// The root mean square error of an image: the mean over kSeeds images and its standard error, both in
/// thousandths.
struct Measured {
    double mean, error;
    /// Adds five standard errors, which are 3.5 of the difference of two such means, but at most 15 %; and at
    /// least 2 %, because rounding differs between compilers and processors.
    double bound() const { return mean + std::clamp(5 * error, .02 * mean, .15 * mean); }
};

struct Row {
    const char* scene;
    float value; ///< of the sweep
    Measured msaa, msaaCache;
    Measured indirectCache{0, 0}; ///< 0: the scene has no indirect light to share
};

// At 32 x 24 pixels, a pixel is five pixels of the scene file: the hardest value is not always the last.
constexpr Row kRows[] = {
    {"moving-shadow", 0, {20.02, 0.535}, {10.90, 0.013}},
    {"moving-shadow", 64, {46.13, 0.446}, {8.49, 0.100}},
    {"contact", 0, {6.76, 0.439}, {8.35, 0.029}},
    {"contact", 64, {13.21, 0.315}, {8.17, 0.115}},
    {"rotation", 0, {12.39, 0.301}, {6.79, 0.022}},
    {"rotation", 360, {12.39, 0.301}, {19.68, 0.184}},
    {"depth-of-field", 0, {23.44, 0.318}, {13.34, 0.016}},
    {"depth-of-field", 160, {41.11, 0.350}, {19.50, 0.262}},
    {"triangle-size", 0, {3.76, 0.079}, {1.65, 0.019}},
    {"triangle-size", 6, {0.99, 0.027}, {1.51, 0.019}},
    {"texture-frequency", 10, {27.31, 0.316}, {10.36, 0.014}},
    {"texture-frequency", 40, {24.73, 0.318}, {13.78, 0.015}},
    {"blur-length", 0, {13.36, 0.306}, {5.68, 0.015}},
    {"blur-length", 64, {22.69, 0.257}, {6.39, 0.050}},
    {"mirror-reflection", 0, {25.15, 0.298}, {11.94, 0.022}},
    {"mirror-reflection", 32, {23.93, 0.354}, {11.83, 0.103}},
    {"glossy-floor", 0.3f, {129.94, 1.117}, {72.45, 0.774}, {21.15, 0.177}},
    {"glossy-floor", 0.003f, {161.67, 1.771}, {164.28, 2.743}, {94.88, 2.289}},
};

/// Returns a line marked "# sweep" with its first number outside of quotes replaced by `value`, which must be
/// one of the values after the mark (tools/strobe_figures/sweeps.py).
std::string replaceSweptNumber(const std::string& line, float value) {
    const size_t mark = line.find('#');
    std::istringstream values(line.substr(line.find(':', mark) + 1));
    bool known = false;
    for (float v; values >> v;)
        known |= v == value;
    EXPECT_TRUE(known) << value << " is not in: " << line;
    const std::regex quotedOrNumber(R"("[^"]*"|([-+]?\d*\.?\d+))");
    for (std::sregex_iterator m(line.begin(), line.begin() + long(mark), quotedOrNumber), end; m != end; ++m)
        if ((*m)[1].matched)
            return line.substr(0, size_t(m->position())) + std::to_string(value) + m->suffix().str();
    ADD_FAILURE() << "no number to replace: " << line;
    return line;
}

std::string sceneText(const Row& row) {
    const std::filesystem::path path =
        std::filesystem::path(STROBE_SOURCE_DIR) / "scenes/stress" / (std::string(row.scene) + ".scene");
    std::ifstream file(path);
    EXPECT_TRUE(file) << path;
    std::string text;
    int marks = 0;
    for (std::string line; std::getline(file, line); text += line + '\n')
        if (line.find("# sweep ") != std::string::npos) {
            line = replaceSweptNumber(line, row.value);
            ++marks;
        }
    EXPECT_EQ(marks, 1) << path;
    return text;
}

std::vector<Image> renderImages(const std::string& text, const char* integrator, int spp, int seeds,
                                uint64_t first) {
    BuildOptions options;
    options.integrator = integrator;
    options.samplesPerPixel = spp;
    options.resolution = V2i(kWidth, kHeight);
    const BuiltScene built = test::build(text, options);
    std::vector<Image> images;
    for (int i = 0; i < seeds; ++i)
        images.push_back(test::render(built, first + uint64_t(i), 1).image);
    return images;
}

/// Returns radiance clipped as by a screen: the error of a bright pixel is at most 1.
double clip(float radiance) { return std::min(double(radiance), 1.0); }

struct Estimate {
    double mean, error;
};

Estimate estimate(const std::vector<double>& values) {
    const double n = double(values.size()), mean = std::accumulate(values.begin(), values.end(), 0.) / n;
    double sum2 = 0;
    for (const double v : values)
        sum2 += sqr(v - mean);
    return {mean, std::sqrt(sum2 / (n * (n - 1)))};
}

/// Returns the mean of the images' root mean square errors against the mean of `references`.
Estimate errorOf(const std::vector<Image>& images, const std::vector<Image>& references) {
    std::vector<double> errors(images.size());
    for (size_t p = 0; p < references[0].pixels.size(); ++p)
        for (int c = 0; c < 3; ++c) {
            double mean = 0;
            for (const Image& t : references)
                mean += clip(t.pixels[p][c]) / double(references.size());
            for (size_t i = 0; i < images.size(); ++i)
                errors[i] += std::pow(clip(images[i].pixels[p][c]) - mean, 2);
        }
    for (double& e : errors)
        e = std::sqrt(e / (3 * double(references[0].pixels.size())));
    return estimate(errors);
}

/// Returns the mean radiance of a tile over several images.
Estimate meanOfTile(const std::vector<Image>& images, int x0, int y0) {
    std::vector<double> means;
    for (const Image& image : images) {
        double sum = 0;
        for (int y = y0; y < y0 + kTile; ++y)
            for (int x = x0; x < x0 + kTile; ++x)
                for (int c = 0; c < 3; ++c)
                    sum += double(image.at(x, y)[c]);
        means.push_back(sum / (3 * kTile * kTile));
    }
    return estimate(means);
}

void expectUnbiased(const std::vector<Image>& images, const std::vector<Image>& references) {
    constexpr size_t kComparisons = std::size(kRows) * (kWidth / kTile) * (kHeight / kTile);
    const double z = test::criticalZ(kComparisons, kSeeds);
    // The shades of msaa, one per pixel, may all miss the edge of a shadow.
    const double unseen = test::unseenProbability(kComparisons, kTile * kTile * kSeeds);
    for (int y = 0; y < kHeight; y += kTile)
        for (int x = 0; x < kWidth; x += kTile) {
            const Estimate a = meanOfTile(images, x, y), b = meanOfTile(references, x, y);
            EXPECT_NEAR(a.mean, b.mean, z * std::hypot(a.error, b.error) + unseen * b.mean + 1e-5)
                << x << ' ' << y;
        }
}

void expectWithinBound(const char* integrator, const Estimate& error, const Measured& measured) {
    EXPECT_LE(1000 * error.mean, measured.bound())
        << integrator << ": measured " << 1000 * error.mean << ", standard error " << 1000 * error.error;
}

class Stability : public testing::TestWithParam<Row> {};

TEST_P(Stability, ErrorsAreWithinTheBounds) {
    const Row& row = GetParam();
    const std::string text = sceneText(row);
    const auto references = renderImages(text, "supersample", kReferenceSamples, kReferences, 1000);
    const auto errorWith = [&](const char* integrator) {
        return errorOf(renderImages(text, integrator, kSamples, kSeeds, 0), references);
    };
    const auto msaa = renderImages(text, "msaa", kSamples, kSeeds, 0);
    expectWithinBound("msaa", errorOf(msaa, references), row.msaa);
    expectUnbiased(msaa, references);
    expectWithinBound("msaa-cache", errorWith("msaa-cache"), row.msaaCache);
    if (row.indirectCache.mean > 0)
        expectWithinBound("indirect-cache", errorWith("indirect-cache"), row.indirectCache);
}

INSTANTIATE_TEST_SUITE_P(Stress, Stability, testing::ValuesIn(kRows), [](const auto& info) {
    std::ostringstream name;
    name << info.param.scene << '_' << info.param.value;
    std::string letters = name.str();
    std::replace_if(
        letters.begin(), letters.end(), [](char c) { return c == '-' || c == '.'; }, '_');
    return letters;
});

} // namespace
} // namespace strobe
