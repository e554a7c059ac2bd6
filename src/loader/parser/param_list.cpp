#include "loader/parser/param_list.h"

#include "core/util/nearest_name.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace strobe {
namespace {

struct TypeWord {
    std::string_view word;
    ParamType type;
    bool isV4 = false; ///< exists in pbrt-v3 and v4 only
};

constexpr TypeWord kTypes[] = {
    {"integer", ParamType::Int},         {"float", ParamType::Float},
    {"bool", ParamType::Bool},           {"string", ParamType::String},
    {"point2", ParamType::Point2, true}, {"vector2", ParamType::Point2, true},
    {"point", ParamType::Vector3},       {"point3", ParamType::Vector3, true},
    {"vector", ParamType::Vector3},      {"vector3", ParamType::Vector3, true},
    {"normal", ParamType::Vector3},      {"normal3", ParamType::Vector3, true},
    {"color", ParamType::Rgb},           {"rgb", ParamType::Rgb, true},
    {"spectrum", ParamType::Spectrum},   {"blackbody", ParamType::Blackbody},
    {"texture", ParamType::Texture},
};

std::string_view takeWord(std::string_view& text) {
    const size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
    const size_t end = std::min(text.find_first_of(" \t", begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    text.remove_prefix(end);
    return word;
}

const TypeWord& findType(std::string_view word, const Location& where) {
    std::vector<std::string> words;
    for (const TypeWord& t : kTypes) {
        if (t.word == word)
            return t;
        words.emplace_back(t.word);
    }
    const std::string nearest = nearestName(word, words);
    throw Error(where,
                fmt::format("unknown parameter type {}{} (known: {})", describe({TokenKind::String, 0, word}),
                            nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?",
                            fmt::join(words, ", ")));
}

/// Reads the value of one parameter.
class ValueReader {
  public:
    /// `lenientDiagnostics`: null in strict files.
    ValueReader(Lexer& lexer, Param& param, bool& looksLikeV4, Diagnostics* lenientDiagnostics)
        : m_lexer(lexer), m_param(param), m_looksLikeV4(looksLikeV4), m_lenient(lenientDiagnostics) {}

    /// Reads the value. Returns false if the parameter is to be ignored.
    bool read() {
        if (m_lexer.peek() == TokenKind::Open) {
            m_open = m_lexer.next();
            readAll();
            expectClose();
        } else {
            readOne();
        }
        return checkCount();
    }

  private:
    const char* expectedValue() const {
        switch (m_param.type) {
        case ParamType::Bool:
            return "true or false";
        case ParamType::String:
            return "a string";
        case ParamType::Texture:
            return "the name of a texture";
        case ParamType::Spectrum:
            return "numbers, the name of a spectrum or a file name";
        default:
            return "a number";
        }
    }
    [[noreturn]] void failUnexpected() {
        const Token token = m_lexer.next();
        throw Error(m_lexer.at(token.offset),
                    fmt::format("parameter \"{}\" needs {}{}, found {}", m_param.name, expectedValue(),
                                m_open ? " or ']'" : "", describe(token)));
    }
    bool takesNumbers() const {
        return m_param.type != ParamType::Bool && m_param.type != ParamType::String &&
               m_param.type != ParamType::Texture;
    }
    bool takesStrings() const { return m_param.type == ParamType::Spectrum || !takesNumbers(); }

    bool readBool() {
        const TokenKind kind = m_lexer.peek();
        if (kind != TokenKind::String && kind != TokenKind::Word)
            return false;
        const Token token = m_lexer.next();
        if (token.text != "true" && token.text != "false")
            throw Error(
                m_lexer.at(token.offset),
                fmt::format("parameter \"{}\" needs true or false, found {}", m_param.name, describe(token)));
        m_looksLikeV4 |= kind == TokenKind::Word;
        m_param.ints.push_back(token.text == "true");
        return true;
    }
    void readOne() {
        const TokenKind kind = m_lexer.peek();
        if (kind == TokenKind::End || (kind == TokenKind::Word && isDirectiveLike()))
            throw Error(m_param.where, fmt::format("parameter \"{}\" has no value", m_param.name));
        if (m_param.type == ParamType::Bool && readBool())
            return;
        if (m_param.type != ParamType::Bool && takesStrings() && kind == TokenKind::String)
            m_param.strings.push_back(m_lexer.unescape(m_lexer.next()));
        else if (m_param.type == ParamType::Int && kind == TokenKind::Number)
            m_param.ints.push_back(m_lexer.readInt());
        else if (takesNumbers() && kind == TokenKind::Number)
            m_param.floats.push_back(m_lexer.readFloat());
        else
            failUnexpected();
    }
    /// Returns true if the next word begins the next directive: it is capitalized, and no NaN or Infinity.
    bool isDirectiveLike() {
        Lexer ahead = m_lexer;
        const std::string_view word = ahead.next().text;
        return word.size() > 4 && word[0] >= 'A' && word[0] <= 'Z' && word != "Infinity";
    }
    void readAll() {
        if (m_param.type == ParamType::Bool) {
            while (readBool()) {
            }
        } else if (m_param.type == ParamType::Int) {
            m_lexer.readInts(m_param.ints);
        } else if (takesNumbers()) {
            m_lexer.readFloats(m_param.floats);
        }
        if (m_param.type != ParamType::Bool && takesStrings() && m_param.floats.empty())
            while (m_lexer.peek() == TokenKind::String)
                m_param.strings.push_back(m_lexer.unescape(m_lexer.next()));
    }
    void expectClose() {
        const TokenKind kind = m_lexer.peek();
        if (kind == TokenKind::End)
            throw Error(m_lexer.at(m_open->offset), "'[' without a closing ']'");
        if (kind != TokenKind::Close)
            failUnexpected();
        m_lexer.next();
    }
    /// Checks that the numbers form groups of n. In lenient files, drops the numbers that are too many, as
    /// pbrt does; returns false if none is left.
    bool checkGroups(size_t n, const char* groups) const {
        const size_t count = m_param.floats.size(), excess = count % n;
        if (excess == 0)
            return true;
        const std::string problem = fmt::format("parameter \"{}\" needs {}, got {} number{}", m_param.name,
                                                groups, count, count == 1 ? "" : "s");
        if (!m_lenient)
            throw Error(m_param.where, problem + (m_open ? "" : "; write them in brackets"));
        m_param.floats.resize(count - excess);
        m_lenient->warn(m_param.where, problem + (count == excess ? "; the parameter is ignored"
                                                                  : "; those at the end are ignored"));
        return count != excess;
    }
    bool checkCount() const {
        switch (m_param.type) {
        case ParamType::Point2:
            return checkGroups(2, "pairs of numbers");
        case ParamType::Vector3:
        case ParamType::Rgb:
            return checkGroups(3, "triples of numbers");
        case ParamType::Spectrum:
            return checkGroups(2, "pairs of a wavelength and a value");
        case ParamType::Texture:
            if (m_param.strings.size() != 1)
                throw Error(m_param.where,
                            fmt::format("parameter \"{}\" needs the name of one texture, got {}",
                                        m_param.name, m_param.strings.size()));
            return true;
        default:
            return true;
        }
    }

    Lexer& m_lexer;
    Param& m_param;
    bool& m_looksLikeV4;
    Diagnostics* m_lenient;
    std::optional<Token> m_open;
};

/// Sorts the pairs of a spectrum by wavelength, as pbrt-v2 and v3 do.
void sortByWavelength(std::vector<float>& pairs) {
    std::vector<std::pair<float, float>> sorted;
    for (size_t i = 0; i + 1 < pairs.size(); i += 2)
        sorted.emplace_back(pairs[i], pairs[i + 1]);
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (size_t i = 0; i < sorted.size(); ++i)
        std::tie(pairs[2 * i], pairs[2 * i + 1]) = sorted[i];
}

/// Reads a parameter. Returns nothing if it is to be ignored.
std::optional<Param> readParam(Lexer& lexer, bool& looksLikeV4, Diagnostics* lenientDiagnostics) {
    const Token declaration = lexer.next();
    const Location where = lexer.at(declaration.offset);
    std::string_view rest = declaration.text;
    const std::string_view typeWord = takeWord(rest), name = takeWord(rest);
    if (name.empty() || !takeWord(rest).empty())
        throw Error(where,
                    fmt::format("expected \"type name\" and a value, found {}", describe(declaration)));
    const TypeWord& type = findType(typeWord, where);
    looksLikeV4 |= type.isV4;
    Param param{std::string(name), type.type, where, {}, {}, {}, false, false};
    if (!ValueReader(lexer, param, looksLikeV4, lenientDiagnostics).read())
        return std::nullopt;
    if (lenientDiagnostics && param.type == ParamType::Spectrum)
        sortByWavelength(param.floats);
    return param;
}

/// Removes the parameters that `param` replaces, as pbrt does: the last one is used, but a value does not
/// replace a texture. Returns false if `param` itself is to be dropped. Reports repeated parameters.
bool replacesOthers(ParamSet& params, const Param& param, Diagnostics& diagnostics) {
    const auto hasSameName = [&](const Param& p) { return p.name == param.name; };
    const auto other = std::find_if(params.all().begin(), params.all().end(), hasSameName);
    if (other == params.all().end())
        return true;
    const bool isKept = other->type != ParamType::Texture || param.type == ParamType::Texture;
    diagnostics.warnOnce("repeated parameter " + param.name, param.where,
                         fmt::format("parameter \"{}\" is given twice; the {} is used", param.name,
                                     isKept && other->type == param.type ? "last value"
                                     : isKept                            ? "last one"
                                                                         : "texture"));
    if (isKept)
        std::erase_if(params.all(), hasSameName);
    return isKept;
}

} // namespace

ParamSet readParams(Lexer& lexer, const Location& where, bool& looksLikeV4, Diagnostics* lenientDiagnostics) {
    ParamSet params(where);
    while (lexer.peek() == TokenKind::String) {
        std::optional<Param> param = readParam(lexer, looksLikeV4, lenientDiagnostics);
        if (!param || (lenientDiagnostics && !replacesOthers(params, *param, *lenientDiagnostics)))
            continue;
        params.add(std::move(*param));
    }
    return params;
}

} // namespace strobe
