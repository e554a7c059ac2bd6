// Parameters as text: the rows behind `strobe --list`, and the command line's `-D name=value`.
#include "core/params/params.h"

#include <fmt/format.h>

#include <cctype>
#include <charconv>

namespace strobe {
namespace {

// How each type is called in the table. parseOverride reads these words back.
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

std::string show(int v) { return fmt::format("{}", v); }
std::string show(float v) { return fmt::format("{}", v); }
std::string show(bool v) { return v ? "true" : "false"; }
std::string show(const std::string& v) { return '"' + v + '"'; }
std::string show(const V2f& v) { return fmt::format("{} {}", v.x, v.y); }
std::string show(const V3f& v) { return fmt::format("{} {} {}", v.x, v.y, v.z); }
std::string show(const Rgb& v) { return fmt::format("{} {} {}", v.x, v.y, v.z); }
std::string show(const FilePath& v) { return v.path.string(); }
std::string show(const FloatInput& v) { return show(v.constant); }
std::string show(const RgbInput& v) { return show(v.constant); }
template <class T>
std::string show(const std::vector<T>& values) {
    std::string text;
    for (const T& v : values)
        text += (text.empty() ? "" : " ") + show(v);
    return text;
}

[[noreturn]] void failOverride(const std::string& word, const std::string& why) {
    throw Error(fmt::format("-D {}: {}", word, why), ErrorKind::Usage);
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

/// The whole of `word` as a finite number.
template <class T>
bool parseNumber(const std::string& word, T& out) {
    const char* begin = word.data() + (word[0] == '+');
    const char* const end = word.data() + word.size();
    const auto [rest, error] = std::from_chars(begin, end, out);
    if constexpr (std::is_floating_point_v<T>)
        return error == std::errc() && rest == end && std::isfinite(out);
    return error == std::errc() && rest == end;
}

/// Why `word` is no T.
template <class T>
std::string whyNot(const std::string& word) {
    long double number = 0; // holds more
    if (!parseNumber(word, number))
        return "is not a number";
    if (std::is_floating_point_v<T>)
        return "does not fit a 32-bit float";
    return std::abs(number) < 0x1p31L ? "is not an integer" : "does not fit a 32-bit integer";
}

template <class T>
std::vector<T> parseNumbers(const std::string& word, const std::string& value, const std::string& type) {
    std::vector<T> numbers;
    for (const std::string& w : splitWords(value))
        if (!parseNumber(w, numbers.emplace_back()))
            failOverride(word, fmt::format("\"{}\" {} ({} is wanted)", w, whyNot<T>(w), type));
    return numbers;
}

void wantCount(const std::string& word, size_t got, size_t wanted, bool isArray) {
    if (isArray ? got % wanted != 0 : got != wanted)
        failOverride(word, fmt::format("{}{} number{} needed, got {}", isArray ? "a multiple of " : "",
                                       wanted, wanted == 1 ? " is" : "s are", got));
}

void parseFloatValues(Param& param, const std::string& word, const std::string& value,
                      const std::string& type, size_t count, bool isArray) {
    param.floats = parseNumbers<float>(word, value, type);
    wantCount(word, param.floats.size(), count, isArray);
}

/// Fills `param` from `value` according to the table's type word.
void parseValue(Param& param, const std::string& word, const std::string& value, const std::string& type) {
    const bool isArray = type.size() > 2 && type.substr(type.size() - 2) == "[]";
    const std::string element = type.substr(0, std::min(type.find(" or "), type.find("[]")));
    if (element == "integer") {
        param.type = ParamType::Int;
        param.ints = parseNumbers<int>(word, value, type);
        wantCount(word, param.ints.size(), 1, isArray);
    } else if (element == "bool") {
        if (value != "true" && value != "false")
            failOverride(word, "true or false is needed");
        param.type = ParamType::Bool;
        param.ints = {value == "true"};
    } else if (element == "string" || element == "file") {
        param.type = ParamType::String;
        param.strings = isArray ? splitWords(value) : std::vector<std::string>{value};
    } else if (element == "point2") {
        param.type = ParamType::Point2;
        parseFloatValues(param, word, value, type, 2, isArray);
    } else if (element == "vector3" || element == "rgb") {
        param.type = element == "rgb" ? ParamType::Rgb : ParamType::Vector3;
        parseFloatValues(param, word, value, type, 3, isArray);
    } else {
        param.type = ParamType::Float;
        parseFloatValues(param, word, value, type, 1, isArray);
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

template <class T>
ParamInfo::ParamInfo(const ParamDef<T>& def)
    : name(def.name), type(typeName(def.fallback)), fallback(show(def.fallback)), doc(def.doc),
      alias(def.alias ? def.alias : "") {}

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

Param parseOverride(const std::string& nameEqualsValue, const std::vector<ParamInfo>& known) {
    const size_t equals = nameEqualsValue.find('=');
    if (equals == std::string::npos || equals == 0)
        failOverride(nameEqualsValue, "write it as name=value");
    const std::string name = nameEqualsValue.substr(0, equals);
    std::vector<std::string> names;
    for (const ParamInfo& info : known) {
        names.push_back(info.name);
        if (info.name != name && (info.alias.empty() || info.alias != name))
            continue;
        Param param{info.name, ParamType::Float, {}, {}, {}, {}, false, false};
        parseValue(param, nameEqualsValue, nameEqualsValue.substr(equals + 1), info.type);
        return param;
    }
    const std::string nearest = nearestName(name, names);
    failOverride(nameEqualsValue, fmt::format("unknown parameter \"{}\"{} (known: {})", name,
                                              nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?",
                                              fmt::join(names, ", ")));
}

} // namespace strobe
