// Parameters as text: the rows of `strobe --list`, and the option `-D name=value`.
#include "core/params/params.h"

#include "core/util/nearest_name.h"

#include <fmt/format.h>

#include <cctype>
#include <charconv>

namespace strobe {
namespace {

// The names of types in `strobe --list`. parseOverride interprets them.
const char* typeName(const int&) { return "integer"; }
const char* typeName(const float&) { return "float"; }
const char* typeName(const bool&) { return "bool"; }
const char* typeName(const std::string&) { return "string"; }
const char* typeName(const V2f&) { return "point2"; }
const char* typeName(const V3f&) { return "vector3"; }
const char* typeName(const Rgb&) { return "rgb"; }
const char* typeName(const FilePath&) { return "file"; }
const char* typeName(const FloatInput&) { return "float or texture"; }
const char* typeName(const RgbInput&) { return "rgb or texture"; }
template <class T>
std::string typeName(const std::vector<T>&) {
    return std::string(typeName(T{})) + "[]";
}

std::string toText(int v) { return fmt::format("{}", v); }
std::string toText(float v) { return fmt::format("{}", v); }
std::string toText(bool v) { return v ? "true" : "false"; }
std::string toText(const std::string& v) { return '"' + v + '"'; }
std::string toText(const V2f& v) { return fmt::format("{} {}", v.x, v.y); }
std::string toText(const V3f& v) { return fmt::format("{} {} {}", v.x, v.y, v.z); }
std::string toText(const Rgb& v) { return fmt::format("{} {} {}", v.x, v.y, v.z); }
std::string toText(const FilePath& v) { return v.path.string(); }
std::string toText(const FloatInput& v) { return toText(v.constant); }
std::string toText(const RgbInput& v) { return toText(v.constant); }
template <class T>
std::string toText(const std::vector<T>& values) {
    std::string text;
    for (const T& v : values)
        text += (text.empty() ? "" : " ") + toText(v);
    return text;
}

[[noreturn]] void failOverride(const std::string& option, const std::string& why) {
    throw Error(fmt::format("-D {}: {}", option, why), ErrorKind::Usage);
}

bool isSeparator(char c) { return std::isspace(static_cast<unsigned char>(c)) || c == ','; }

std::vector<std::string> splitWords(std::string_view text) {
    std::vector<std::string> words;
    for (size_t i = 0; i < text.size();) {
        while (i < text.size() && isSeparator(text[i]))
            ++i;
        const size_t begin = i;
        while (i < text.size() && !isSeparator(text[i]))
            ++i;
        if (i > begin)
            words.emplace_back(text.substr(begin, i - begin));
    }
    return words;
}

/// Parses all of `word` as a finite number. Returns false on failure.
template <class T>
bool parseNumber(const std::string& word, T& out) {
    const char* begin = word.data() + (word[0] == '+');
    const char* const end = word.data() + word.size();
    const auto [rest, error] = std::from_chars(begin, end, out);
    if constexpr (std::is_floating_point_v<T>)
        return error == std::errc() && rest == end && std::isfinite(out);
    return error == std::errc() && rest == end;
}

/// Returns why `word` is not a T.
template <class T>
std::string mismatch(const std::string& word) {
    long double number = 0; // also represents numbers beyond the range of T
    if (!parseNumber(word, number))
        return "is not a number";
    if (std::is_floating_point_v<T>)
        return "does not fit a 32-bit float";
    return std::abs(number) < 0x1p31L ? "is not an integer" : "does not fit a 32-bit integer";
}

template <class T>
std::vector<T> parseNumbers(const std::string& option, const std::string& value, const std::string& type) {
    std::vector<T> numbers;
    for (const std::string& word : splitWords(value))
        if (!parseNumber(word, numbers.emplace_back()))
            failOverride(option, fmt::format("\"{}\" {} ({} is expected)", word, mismatch<T>(word), type));
    return numbers;
}

void checkCount(const std::string& option, size_t count, size_t expected, bool isArray) {
    if (isArray ? count % expected != 0 : count != expected)
        failOverride(option, fmt::format("{}{} number{} needed, got {}", isArray ? "a multiple of " : "",
                                         expected, expected == 1 ? " is" : "s are", count));
}

void parseFloatValues(Param& param, const std::string& option, const std::string& value,
                      const std::string& type, size_t count, bool isArray) {
    param.floats = parseNumbers<float>(option, value, type);
    checkCount(option, param.floats.size(), count, isArray);
}

/// Parses `value` as a value of `type`, one of the names of typeName.
void parseValue(Param& param, const std::string& option, const std::string& value, const std::string& type) {
    const bool isArray = type.size() > 2 && type.substr(type.size() - 2) == "[]";
    const std::string element = type.substr(0, std::min(type.find(" or "), type.find("[]")));
    if (element == "integer") {
        param.type = ParamType::Int;
        param.ints = parseNumbers<int>(option, value, type);
        checkCount(option, param.ints.size(), 1, isArray);
    } else if (element == "bool") {
        if (value != "true" && value != "false")
            failOverride(option, "true or false is expected");
        param.type = ParamType::Bool;
        param.ints = {value == "true"};
    } else if (element == "string" || element == "file") {
        param.type = ParamType::String;
        param.strings = isArray ? splitWords(value) : std::vector<std::string>{value};
    } else if (element == "point2") {
        param.type = ParamType::Point2;
        parseFloatValues(param, option, value, type, 2, isArray);
    } else if (element == "vector3" || element == "rgb") {
        param.type = element == "rgb" ? ParamType::Rgb : ParamType::Vector3;
        parseFloatValues(param, option, value, type, 3, isArray);
    } else {
        param.type = ParamType::Float;
        parseFloatValues(param, option, value, type, 1, isArray);
    }
}

} // namespace

std::string ParamRange::problem(double value) const {
    if (value > max)
        return fmt::format("must be at most {:.10g}", max);
    if (min == 0)
        return aboveMin ? "must be positive" : "must not be negative";
    return fmt::format("must be {} {:.10g}", aboveMin ? "above" : "at least", min);
}

std::string ParamRange::description() const {
    if (isUnlimited())
        return "";
    const std::string lower = fmt::format("{} {:.10g}", aboveMin ? "above" : "at least", min);
    if (max == kInfinity)
        return lower;
    return aboveMin ? fmt::format("{}, at most {:.10g}", lower, max)
                    : fmt::format("{:.10g} to {:.10g}", min, max);
}

template <class T>
ParamInfo::ParamInfo(const ParamDef<T>& def)
    : name(def.name), type(typeName(def.fallback)), fallback(toText(def.fallback)), doc(def.doc),
      alias(def.alias ? def.alias : ""),
      range((def.range.isUnlimited() ? def.physical : def.range).description()), physical(def.physical) {}

template ParamInfo::ParamInfo(const ParamDef<int>&);
template ParamInfo::ParamInfo(const ParamDef<float>&);
template ParamInfo::ParamInfo(const ParamDef<bool>&);
template ParamInfo::ParamInfo(const ParamDef<std::string>&);
template ParamInfo::ParamInfo(const ParamDef<V2f>&);
template ParamInfo::ParamInfo(const ParamDef<V3f>&);
template ParamInfo::ParamInfo(const ParamDef<Rgb>&);
template ParamInfo::ParamInfo(const ParamDef<FilePath>&);
template ParamInfo::ParamInfo(const ParamDef<FloatInput>&);
template ParamInfo::ParamInfo(const ParamDef<RgbInput>&);
template ParamInfo::ParamInfo(const ParamDef<std::vector<int>>&);
template ParamInfo::ParamInfo(const ParamDef<std::vector<float>>&);
template ParamInfo::ParamInfo(const ParamDef<std::vector<std::string>>&);
template ParamInfo::ParamInfo(const ParamDef<std::vector<V2f>>&);
template ParamInfo::ParamInfo(const ParamDef<std::vector<V3f>>&);

Param parseOverride(const std::string& option, const std::vector<ParamInfo>& known) {
    const size_t equals = option.find('=');
    if (equals == std::string::npos || equals == 0)
        failOverride(option, "write it as name=value");
    const std::string name = option.substr(0, equals);
    std::vector<std::string> names;
    for (const ParamInfo& info : known) {
        names.push_back(info.name);
        if (info.name != name && (info.alias.empty() || info.alias != name))
            continue;
        Param param{info.name, ParamType::Float, {}, {}, {}, {}, false, false, true};
        parseValue(param, option, option.substr(equals + 1), info.type);
        return param;
    }
    const std::string nearest = nearestName(name, names);
    failOverride(option, fmt::format("unknown parameter \"{}\"{} (known: {})", name,
                                     nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?",
                                     fmt::join(names, ", ")));
}

} // namespace strobe
