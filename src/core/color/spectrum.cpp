#include "core/color/spectrum.h"

#include "core/color/cie.h"

#include <cctype>
#include <charconv>
#include <fstream>
#include <vector>

namespace strobe {
namespace {

/// Writes x̄, ȳ, z̄ at wavelength `nm` to `out`. The table is interpolated cubically (four-point Lagrange),
/// which reproduces the published 1 nm table to its precision; with linear interpolation, metals have a
/// visible error.
void colorMatching(int nm, double out[3]) {
    constexpr int kLast = (kCieLast - kCieFirst) / kCieStep;
    const int i = (nm - kCieFirst) / kCieStep;
    const double f = double((nm - kCieFirst) % kCieStep) / kCieStep;
    const double weight[4] = {-f * (f - 1) * (f - 2) / 6, (f + 1) * (f - 1) * (f - 2) / 2,
                              -(f + 1) * f * (f - 2) / 2, (f + 1) * f * (f - 1) / 6};
    out[0] = out[1] = out[2] = 0;
    for (int k = 0; k < 4; ++k)
        for (int c = 0; c < 3; ++c)
            out[c] += weight[k] * double(kCie[std::clamp(i + k - 1, 0, kLast)][c]);
}

/// Returns the RGB of the spectrum value(nm), integrated in steps of 1 nm.
template <class F>
Rgb integrate(F value) {
    double xyz[3] = {}, sumY = 0;
    for (int nm = kCieFirst; nm <= kCieLast; ++nm) {
        double curve[3];
        colorMatching(nm, curve);
        const double v = value(nm);
        for (int c = 0; c < 3; ++c)
            xyz[c] += curve[c] * v;
        sumY += curve[1];
    }
    const double x = xyz[0] / sumY, y = xyz[1] / sumY, z = xyz[2] / sumY;
    return Rgb(float(3.240479 * x - 1.537150 * y - 0.498535 * z),
               float(-0.969256 * x + 1.875991 * y + 0.041556 * z),
               float(0.055648 * x - 0.204043 * y + 1.057311 * z));
}

/// Returns Planck's law normalized to 1 at its maximum; `x` is the wavelength divided by the wavelength of
/// the maximum (Wien's displacement law).
double planck(double x) {
    constexpr double kPeak = 4.965114231744276; // hc / (λ k T) at the maximum
    return std::expm1(kPeak) / std::expm1(kPeak / x) / (x * x * x * x * x);
}

struct Entry {
    const char* name;
    Rgb value;
};

// Metals: integrals of the tables of pbrt, divided by the integral of a constant spectrum. Glasses: n_d in
// the data sheet of the manufacturer.
const Entry kNamed[] = {
    {"metal-Ag-eta", {0.12886f, 0.12310f, 0.15219f}},
    {"metal-Ag-k", {4.00730f, 3.29272f, 2.36119f}},
    {"metal-Al-eta", {1.37561f, 0.92843f, 0.57324f}},
    {"metal-Al-k", {7.65539f, 6.61183f, 5.31967f}},
    {"metal-Au-eta", {0.11878f, 0.39541f, 1.58644f}},
    {"metal-Au-k", {3.30585f, 2.51598f, 1.76319f}},
    {"metal-Cu-eta", {0.16634f, 0.97450f, 1.21220f}},
    {"metal-Cu-k", {3.24756f, 2.58676f, 2.35595f}},
    {"metal-CuZn-eta", {0.43138f, 0.51518f, 1.14599f}},
    {"metal-CuZn-k", {3.59418f, 2.68723f, 1.75074f}},
    {"metal-MgO-eta", {1.73431f, 1.74084f, 1.75402f}},
    {"metal-MgO-k", Rgb(0)},
    {"metal-TiO2-eta", {2.86883f, 2.95468f, 3.19504f}},
    {"metal-TiO2-k", {0.00009f, 0.f, 0.0007f}},
    {"glass-BK7", Rgb(1.5168f)},
    {"glass-BAF10", Rgb(1.6700f)},
    {"glass-FK51A", Rgb(1.4866f)},
    {"glass-LASF9", Rgb(1.8503f)},
    {"glass-F5", Rgb(1.6034f)},
    {"glass-F10", Rgb(1.6228f)},
    {"glass-F11", Rgb(1.6206f)},
    {"glass-SF5", Rgb(1.6727f)},
    {"glass-SF10", Rgb(1.7283f)},
    {"glass-SF11", Rgb(1.7847f)},
};

} // namespace

Rgb spectrumToRgb(std::span<const float> wavelengths, std::span<const float> values) {
    if (wavelengths.empty() || wavelengths.size() != values.size())
        throw Error("a spectrum needs as many values as wavelengths, and at least one");
    size_t i = 0; // index of the first sample above nm
    return integrate([&](int nm) -> double {
        while (i < wavelengths.size() && wavelengths[i] <= float(nm))
            ++i;
        if (i == 0)
            return values.front();
        if (i == wavelengths.size())
            return values.back();
        const double a = wavelengths[i - 1], b = wavelengths[i];
        const double t = (nm - a) / (b - a);
        return (1 - t) * values[i - 1] + t * values[i];
    });
}

Rgb blackbodyRgb(float kelvin, float scale) {
    if (!(kelvin > 0))
        return Rgb(0);
    const double peak = 2.897771955e6 / kelvin; // nm
    return integrate([&](int nm) { return planck(nm / peak); }) * scale;
}

namespace {

/// Returns the numbers of one line up to a #. Throws Error if a word is not a number.
std::vector<float> parseLine(std::string line, const std::filesystem::path& path, int lineNumber,
                             const Location& where) {
    line.resize(std::min(line.size(), line.find('#')));
    std::vector<float> numbers;
    for (const char *p = line.data(), *end = p + line.size(); p != end;) {
        if (std::isspace(static_cast<unsigned char>(*p))) {
            ++p;
            continue;
        }
        float value;
        const auto [next, error] = std::from_chars(*p == '+' ? p + 1 : p, end, value);
        if (error != std::errc() || !std::isfinite(value) ||
            (next != end && !std::isspace(static_cast<unsigned char>(*next))))
            throw Error(where, path.string() + ":" + std::to_string(lineNumber) + ": not a number");
        numbers.push_back(value);
        p = next;
    }
    return numbers;
}

} // namespace

Rgb readSpd(const std::filesystem::path& path, const Location& where) {
    std::ifstream file(path);
    if (!file)
        throw Error(where, "cannot read the spectrum file " + path.string());
    std::vector<float> wavelengths, values;
    std::string line;
    for (int lineNumber = 1; std::getline(file, line); ++lineNumber) {
        const std::vector<float> numbers = parseLine(std::move(line), path, lineNumber, where);
        const std::string prefix = path.string() + ":" + std::to_string(lineNumber) + ": ";
        if (numbers.size() % 2 != 0)
            throw Error(where, prefix + "expected a wavelength and a value");
        for (size_t i = 0; i < numbers.size(); i += 2) {
            if (!wavelengths.empty() && numbers[i] <= wavelengths.back())
                throw Error(where, prefix + "wavelengths must ascend");
            wavelengths.push_back(numbers[i]);
            values.push_back(numbers[i + 1]);
        }
    }
    if (wavelengths.empty())
        throw Error(where, "the spectrum file " + path.string() + " holds no samples");
    return spectrumToRgb(wavelengths, values);
}

namespace {

/// The chromaticity of a standard illuminant for the 2° observer (CIE 15:2004).
struct Illuminant {
    std::string_view name;
    float x, y;
};
constexpr Illuminant kIlluminants[] = {
    {"acesD60", .32168f, .33767f}, {"A", .44757f, .40745f},   {"D50", .34567f, .35850f},
    {"D65", .31272f, .32903f},     {"F1", .31310f, .33727f},  {"F2", .37208f, .37529f},
    {"F3", .40910f, .39430f},      {"F4", .44018f, .40329f},  {"F5", .31379f, .34531f},
    {"F6", .37790f, .38835f},      {"F7", .31292f, .32933f},  {"F8", .34588f, .35875f},
    {"F9", .37417f, .37281f},      {"F10", .34609f, .35986f}, {"F11", .38052f, .37713f},
    {"F12", .43695f, .40441f}};

std::optional<Rgb> illuminant(std::string_view name) {
    for (const Illuminant& light : kIlluminants)
        if (name == light.name) {
            const float x = light.x / light.y, z = (1 - light.x - light.y) / light.y;
            const Rgb c(3.240970f * x - 1.537383f - .498611f * z, -.969244f * x + 1.875968f + .041555f * z,
                        .055630f * x - .203977f + 1.056972f * z); // IEC 61966-2-1
            return Rgb(std::max(c.x, 0.f), std::max(c.y, 0.f), std::max(c.z, 0.f));
        }
    return std::nullopt;
}

} // namespace

std::optional<Rgb> namedSpectrum(const std::string& name) {
    for (const std::string_view prefix : {"stdillum-", "illum-"})
        if (name.starts_with(prefix))
            return illuminant(std::string_view(name).substr(prefix.size()));
    for (const Entry& entry : kNamed)
        if (name == entry.name)
            return entry.value;
    return std::nullopt;
}

} // namespace strobe
