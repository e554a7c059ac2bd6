#include "materials/irregular_brdf.h"

#include "core/color/spectrum.h"

#include <charconv>
#include <fstream>
#include <span>
#include <sstream>
#include <string>

namespace strobe {
namespace {

/// Returns all numbers of a text file. A # starts a comment that ends with its line.
std::vector<float> readNumbers(const std::filesystem::path& path, const Location& where) {
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw Error(where, "cannot read the BRDF file " + path.string());
    std::ostringstream buffer;
    buffer << file.rdbuf();
    const std::string text = buffer.str();
    std::vector<float> numbers;
    for (const char *p = text.data(), *end = p + text.size(); p != end;) {
        if (*p == '#') {
            p = std::find(p, end, '\n');
        } else if (*p == ' ' || (*p >= '\t' && *p <= '\r')) {
            ++p;
        } else {
            float value;
            const auto [next, error] = std::from_chars(p, end, value);
            if (error != std::errc() || !std::isfinite(value))
                throw Error(where, "BRDF file " + path.string() + ", line " +
                                       std::to_string(1 + std::count(text.data(), p, '\n')) +
                                       ": not a number");
            numbers.push_back(value);
            p = next;
        }
    }
    return numbers;
}

/// Returns the unit vector of spherical coordinates in radians.
V3f direction(float theta, float phi) {
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

} // namespace

std::vector<IrregularBrdf::Sample> readIrregularBrdf(const std::filesystem::path& path,
                                                     const Location& where) {
    const std::vector<float> numbers = readNumbers(path, where);
    const auto fail = [&](const std::string& reason) {
        return Error(where, "BRDF file " + path.string() + ": " + reason);
    };
    if (numbers.empty() || !(numbers[0] >= 1) || numbers[0] != std::floor(numbers[0]) ||
        numbers[0] > float(numbers.size()))
        throw fail("the first number must be the number of wavelengths");
    const size_t n = size_t(numbers[0]), record = 4 + n;
    if (numbers.size() < 1 + n + record || (numbers.size() - 1 - n) % record != 0)
        throw fail(std::to_string(numbers.size()) + " numbers are not a whole number of records of " +
                   std::to_string(record));
    const std::span<const float> wavelengths(&numbers[1], n);
    for (size_t i = 1; i < n; ++i)
        if (!(wavelengths[i] > wavelengths[i - 1]))
            throw fail("the wavelengths must ascend");
    std::vector<IrregularBrdf::Sample> samples;
    for (size_t i = 1 + n; i < numbers.size(); i += record) {
        const V3f wi = direction(numbers[i], numbers[i + 1]), wo = direction(numbers[i + 2], numbers[i + 3]);
        samples.push_back({IrregularBrdf::keyOf(wo, wi), spectrumToRgb(wavelengths, {&numbers[i + 4], n})});
    }
    return samples;
}

} // namespace strobe
