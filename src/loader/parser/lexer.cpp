#include "loader/parser/lexer.h"

#include "core/util/file_bytes.h"
#include "core/util/nearest_name.h"
#include "core/util/resource_policy.h"
#include "core/util/standard_files.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <iostream>
#include <limits>

namespace strobe {
namespace {

bool isBlank(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\f' || c == '\v'; }
bool isDigit(char c) { return c >= '0' && c <= '9'; }
bool isLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool startsNumber(char c) { return isDigit(c) || c == '-' || c == '.' || c == '+'; }
bool isDelimiter(char c) { return isBlank(c) || c == ']' || c == '[' || c == '"' || c == '#'; }

std::string printable(std::string_view text) {
    constexpr size_t kMax = 40;
    std::string shown(text.substr(0, kMax));
    for (char& c : shown)
        c = (c < ' ' || c > '~') ? '?' : c;
    return text.size() > kMax ? shown + "..." : shown;
}

/// As std::from_chars, which accepts no leading '+'.
template <class T>
std::from_chars_result fromChars(const char* begin, const char* end, T& value) {
    if (begin != end && *begin == '+' && begin + 1 != end && begin[1] != '-')
        ++begin;
    // std::from_chars accepts "inf" and "nan" after a sign.
    const char* const first = begin + (begin != end && *begin == '-');
    if (first == end || !(isDigit(*first) || *first == '.'))
        return {begin, std::errc::invalid_argument};
    return std::from_chars(begin, end, value);
}

/// Returns true if a number out of the type's range is too small rather than too large.
bool isUnderflow(std::string_view number) {
    const size_t exponent = number.find_first_of("eE");
    if (exponent != std::string_view::npos)
        return exponent + 1 < number.size() && number[exponent + 1] == '-';
    const size_t digit = number.find_first_not_of("+-0");
    return digit != std::string_view::npos && number[digit] == '.';
}

std::string readStandardInput() { return {std::istreambuf_iterator<char>(std::cin), {}}; }

} // namespace

Lexer::Lexer(std::shared_ptr<const Source> source, SceneValues* values)
    : m_source(std::move(source)), m_text(m_source->text), m_values(values) {
    if (m_text.substr(0, 3) == "\xEF\xBB\xBF") // byte order mark of UTF-8
        m_pos = 3;
}

void Lexer::skipBlanks() {
    for (;;) {
        while (m_pos < m_text.size()) {
            const char c = m_text[m_pos];
            if (isBlank(c))
                ++m_pos;
            else if (c == '#')
                m_pos = std::min(m_text.find('\n', m_pos), m_text.size());
            else if (c == '$' && m_values)
                beginValue();
            else
                return;
        }
        if (!m_outer)
            return;
        endValue();
    }
}

size_t Lexer::nameLength(std::string_view text) {
    size_t end = !text.empty() && isLetter(text[0]) ? 1 : 0;
    while (end > 0 && end < text.size() && (isLetter(text[end]) || isDigit(text[end])))
        ++end;
    return end;
}

void Lexer::beginValue() {
    const std::string_view rest = m_text.substr(m_pos + 1);
    const std::string name(rest.substr(0, nameLength(rest)));
    if (name.empty() || m_outer)
        throw Error(at(offset()), m_outer ? "a value cannot contain another value" : "'$' without a name");
    const std::string* value = m_values->find(name);
    if (!value)
        throw Error(at(m_pos), fmt::format("$ with an {}; -D {}=VALUE or Default \"{}\" \"VALUE\" sets it",
                                           unknownName("name", name, m_values->names()), name, name));
    m_outer = Outer{m_pos, m_pos + 1 + name.size()};
    m_text = *value;
    m_pos = 0;
}

void Lexer::endValue() {
    m_text = m_source->text;
    m_pos = m_outer->next;
    m_outer.reset();
}

std::string Lexer::withValues(std::string text) const {
    if (!m_values)
        return text;
    for (size_t dollar = text.find('$'); dollar != std::string::npos; dollar = text.find('$', dollar + 1)) {
        const size_t brace = dollar + 1 < text.size() && text[dollar + 1] == '{';
        const std::string name =
            text.substr(dollar + 1 + brace, nameLength(std::string_view(text).substr(dollar + 1 + brace)));
        const size_t end = dollar + 1 + brace + name.size();
        const bool isClosed = brace == 0 || (end < text.size() && text[end] == '}');
        const std::string* value = isClosed && !name.empty() ? m_values->find(name) : nullptr;
        if (!value)
            continue;
        text.replace(dollar, end + brace - dollar, *value);
        dollar += value->size() - 1;
    }
    return text;
}

TokenKind Lexer::peek() {
    skipBlanks();
    if (m_pos == m_text.size())
        return TokenKind::End;
    const char c = m_text[m_pos];
    if (c == '"')
        return TokenKind::String;
    if (c == '[')
        return TokenKind::Open;
    if (c == ']')
        return TokenKind::Close;
    if (startsNumber(c))
        return TokenKind::Number;
    if (isLetter(c))
        return TokenKind::Word;
    if (c > ' ' && c <= '~')
        throw Error(at(offset()), fmt::format("unexpected character '{}'", c));
    throw Error(at(offset()), fmt::format("unexpected byte 0x{:02x}; is this a text file?",
                                          static_cast<unsigned>(static_cast<unsigned char>(c))));
}

Token Lexer::next() {
    const TokenKind kind = peek();
    const size_t begin = m_pos;
    switch (kind) {
    case TokenKind::End:
        break;
    case TokenKind::String:
        return readString();
    case TokenKind::Open:
    case TokenKind::Close:
        ++m_pos;
        break;
    case TokenKind::Number:
        m_pos += numberText().size();
        break;
    case TokenKind::Word:
        return readWord();
    }
    return {kind, m_outer ? m_outer->dollar : begin, m_text.substr(begin, m_pos - begin)};
}

Token Lexer::readWord() {
    const size_t begin = m_pos;
    while (m_pos < m_text.size() && (isLetter(m_text[m_pos]) || isDigit(m_text[m_pos])))
        ++m_pos;
    return {TokenKind::Word, m_outer ? m_outer->dollar : begin, m_text.substr(begin, m_pos - begin)};
}

Token Lexer::readString() {
    const size_t quote = m_pos++;
    for (; m_pos < m_text.size() && m_text[m_pos] != '\n'; ++m_pos) {
        if (m_text[m_pos] == '"') {
            ++m_pos;
            return {TokenKind::String, m_outer ? m_outer->dollar : quote,
                    m_text.substr(quote + 1, m_pos - quote - 2)};
        }
        if (m_text[m_pos] == '\\' && m_pos + 1 < m_text.size() && m_text[m_pos + 1] != '\n')
            ++m_pos;
    }
    throw Error(at(m_outer ? m_outer->dollar : quote), "string without a closing quote on the same line");
}

std::string Lexer::unescape(const Token& token) const {
    constexpr std::string_view kCodes = "bfnrt\\\"'", kMeanings = "\b\f\n\r\t\\\"'";
    std::string plain;
    plain.reserve(token.text.size());
    for (size_t i = 0; i < token.text.size(); ++i) {
        char c = token.text[i];
        if (c == '\\') { // readString guarantees that a character follows
            const size_t code = kCodes.find(token.text[++i]);
            if (code == std::string_view::npos)
                throw Error(at(token.offset + i),
                            fmt::format("unknown escape '\\{}'; write a backslash as '\\\\'",
                                        printable(token.text.substr(i, 1))));
            c = kMeanings[code];
        }
        plain += c;
    }
    return token.text.find('$') == std::string_view::npos ? plain : withValues(std::move(plain));
}

std::string_view Lexer::numberText() const {
    size_t end = m_pos;
    while (end < m_text.size() && !isDelimiter(m_text[end]))
        ++end;
    return m_text.substr(m_pos, end - m_pos);
}

void Lexer::failNumber(std::string_view text, const char* why) const {
    throw Error(at(offset()), fmt::format("'{}' {}", printable(text), why));
}

float Lexer::readFloat() {
    skipBlanks();
    const char* const begin = m_text.data() + m_pos;
    const char* const end = m_text.data() + m_text.size();
    float value = 0;
    const auto [rest, error] = fromChars(begin, end, value);
    const bool rangeError = error == std::errc::result_out_of_range || std::isinf(value);
    if ((error != std::errc() && !rangeError) || (rest != end && !isDelimiter(*rest)))
        failNumber(numberText(), "is not a number");
    if (rangeError) {
        if (!isUnderflow(numberText()))
            failNumber(numberText(), "is too large for a 32-bit float");
        value = 0;
    }
    m_pos += rest - begin;
    return value;
}

double Lexer::readDouble() {
    skipBlanks();
    const std::string_view text = numberText();
    double value = 0;
    const auto [rest, error] = fromChars(text.data(), text.data() + text.size(), value);
    const bool rangeError = error == std::errc::result_out_of_range || std::isinf(value);
    if ((error != std::errc() && !rangeError) || rest != text.data() + text.size())
        failNumber(text, "is not a number");
    if (rangeError && !isUnderflow(text))
        failNumber(text, "is too large");
    m_pos += text.size();
    return rangeError ? 0 : value;
}

int Lexer::readInt() {
    skipBlanks();
    const char* const begin = m_text.data() + m_pos;
    const char* const end = m_text.data() + m_text.size();
    int value = 0;
    const auto [rest, error] = fromChars(begin, end, value);
    if (error == std::errc() && (rest == end || isDelimiter(*rest))) {
        m_pos += rest - begin;
        return value;
    }
    const size_t pos = m_pos; // other notations, as 3.0 and 1e3
    const std::string_view text = numberText();
    const double number = readDouble();
    m_pos = pos;
    if (number != std::trunc(number))
        failNumber(text, "is not an integer");
    if (number < std::numeric_limits<int>::min() || number > std::numeric_limits<int>::max())
        failNumber(text, "does not fit a 32-bit integer");
    m_pos += text.size();
    return static_cast<int>(number);
}

template <class T, class ReadOne>
void Lexer::readMany(std::vector<T>& out, ReadOne readOne) {
    constexpr size_t kProbe = 4096; // numbers from whose mean length the length of the list is estimated
    const size_t first = m_pos;
    skipBlanks();
    for (size_t count = 1; m_pos < m_text.size() && startsNumber(m_text[m_pos]); ++count) {
        out.push_back(readOne());
        if (count == kProbe) {
            const size_t close = m_text.find(']', m_pos);
            const double perByte = 1.03 * kProbe / (m_pos - first);
            if (close != std::string_view::npos) // one allocation instead of repeated doubling
                out.reserve(out.size() + static_cast<size_t>((close - m_pos) * perByte));
        }
        skipBlanks();
    }
}

void Lexer::readFloats(std::vector<float>& out) {
    readMany(out, [this] { return readFloat(); });
}
void Lexer::readInts(std::vector<int>& out) {
    readMany(out, [this] { return readInt(); });
}

std::string describe(const Token& token) {
    if (token.kind == TokenKind::End)
        return "the end of the file";
    if (token.kind == TokenKind::String)
        return '"' + printable(token.text) + '"';
    return '\'' + printable(token.text) + '\'';
}

std::shared_ptr<const Source> readSource(const std::filesystem::path& path,
                                         const std::filesystem::path& mainDirectory, const Location& where,
                                         std::shared_ptr<const ResourcePolicy> policy) {
    if (isStandardStream(path) && !where)
        return makeSource(readStandardInput(), path, std::move(policy));
    const std::filesystem::path admitted = policy ? policy->authorizeRead(path, where) : path;
    try {
        const FileBytes file = readFileBytes(admitted, [&](uint64_t bytes) {
            if (policy)
                policy->requireMemory(bytes, "the text of \"" + path.string() + '"', "split the scene",
                                      where);
        });
        return std::make_shared<Source>(path, file.view(), file.bytes, mainDirectory, std::move(policy));
    } catch (const Error&) {
        throw;
    } catch (const std::runtime_error& e) {
        throw Error(where, fmt::format("cannot read \"{}\": {}", path.string(), e.what()),
                    where ? ErrorKind::Scene : ErrorKind::Usage);
    }
}

std::shared_ptr<const Source> makeSource(std::string text, const std::filesystem::path& name,
                                         std::shared_ptr<const ResourcePolicy> policy) {
    const auto owner = std::make_shared<const std::string>(std::move(text));
    return std::make_shared<Source>(name, *owner, owner, name.parent_path(), std::move(policy));
}

} // namespace strobe
