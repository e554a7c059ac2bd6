#include "cli/options/option_validators.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

namespace strobe {
namespace {

/// Parses a number as CLI11 does. Returns none if it is not finite or does not fit T.
template <class T>
std::optional<T> parseNumber(const std::string& text) {
    T value = 0;
    return CLI::detail::lexical_cast(text, value) && std::isfinite(value) ? std::optional(value)
                                                                          : std::nullopt;
}

/// Returns a validator that does not change the text. `check` returns an error or an empty text.
CLI::Validator makeCheck(std::function<std::string(const std::string&)> check) {
    return CLI::Validator([check = std::move(check)](const std::string& text) { return check(text); }, "");
}

/// Returns the bytes in a unit such as "", "K", "MB" or "GiB"; 0 for others.
double bytesIn(std::string_view unit) {
    if (unit.empty())
        return 1;
    constexpr std::string_view kLetters = "KMGT";
    const size_t power = kLetters.find(char(std::toupper(static_cast<unsigned char>(unit.front()))));
    const std::string_view rest = unit.substr(1);
    const bool isUnit = rest.empty() || rest == "B" || rest == "b" || rest == "iB" || rest == "ib";
    return power != std::string_view::npos && isUnit ? std::pow(1024., double(power + 1)) : 0;
}

/// Returns bytes; 0 if the text is not a size, or beyond 1 PiB.
uint64_t parseSize(const std::string& text) {
    constexpr double kMax = double(uint64_t(1) << 50);
    double number = 0;
    const char* const end = text.data() + text.size();
    auto [rest, error] = std::from_chars(text.data(), end, number, std::chars_format::fixed);
    rest = std::find_if(rest, end, [](char c) { return c != ' '; });
    const double bytes = number * bytesIn({rest, size_t(end - rest)});
    return error == std::errc() && bytes > 0 && bytes <= kMax ? uint64_t(bytes) : 0;
}

} // namespace

template <class T>
CLI::Validator finiteNumber() {
    return makeCheck([](const std::string& text) { return parseNumber<T>(text) ? "" : "takes a number"; });
}
template CLI::Validator finiteNumber<float>();

template <class T>
CLI::Validator numberAboveZero() {
    return makeCheck([](const std::string& text) {
        return parseNumber<T>(text).value_or(0) > 0 ? "" : "takes a number above 0";
    });
}
template CLI::Validator numberAboveZero<float>();
template CLI::Validator numberAboveZero<double>();

CLI::Validator integerBetween(uint64_t min, uint64_t max) {
    const auto transform = [=](std::string& text) -> std::string {
        const bool isHexadecimal = text.starts_with("0x");
        const char* const begin = text.data() + (isHexadecimal ? 2 : 0);
        const char* const end = text.data() + text.size();
        uint64_t value = 0;
        const auto [rest, error] = std::from_chars(begin, end, value, isHexadecimal ? 16 : 10);
        if (rest != end || error == std::errc::invalid_argument || (error == std::errc() && value < min))
            return "takes an integer of at least " + std::to_string(min);
        if (error != std::errc() || value > max)
            return "takes an integer of at most " + std::to_string(max);
        text = std::to_string(value);
        return "";
    };
    return CLI::Validator(transform, "");
}

CLI::Validator byteSize(uint64_t min) {
    return CLI::Validator(
        [=](std::string& text) -> std::string {
            const uint64_t size = parseSize(text);
            if (size < min)
                return "takes a size such as 4G or 800M, at least " + std::to_string(min >> 20) + "M";
            text = std::to_string(size);
            return "";
        },
        "");
}

} // namespace strobe
