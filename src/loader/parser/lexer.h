// The words of the scene language. Numbers go straight from the text into vectors: a scene is mostly numbers.
#pragma once

#include "core/util/error.h"

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace strobe {

enum class TokenKind { End, Word, String, Number, Open, Close };

/// A piece of the source; `text` points into it. A String's text excludes the quotes and keeps escapes.
struct Token {
    TokenKind kind = TokenKind::End;
    size_t offset = 0;
    std::string_view text;
};

/// Reads one source from front to back. Blanks and `#` comments separate tokens. All errors are located.
class Lexer {
  public:
    explicit Lexer(std::shared_ptr<const Source> source);

    /// The kind of the next token, which stays unread. Judged by its first character.
    TokenKind peek();
    /// Reads a token of any kind; at the end of the text, End for ever.
    Token next();
    /// A finite number; the next token must be a Number.
    float readFloat();
    double readDouble();
    /// A 32-bit integer; `3.0` and `1e3` are integers, `3.5` is an error.
    int readInt();
    /// Appends numbers up to the first token that is not one.
    void readFloats(std::vector<float>& out);
    void readInts(std::vector<int>& out);
    /// The text of a String token with its escapes (\n \t \" \\ …) replaced.
    std::string unescape(const Token& token) const;

    Location at(size_t offset) const { return {m_source, offset}; }
    Location here() { return (peek(), at(m_pos)); } ///< of the next token
    const Source& source() const { return *m_source; }

  private:
    void skipBlanks();
    Token readString();
    Token readWord();
    std::string_view numberText() const; ///< the number at the current position, up to its delimiter
    [[noreturn]] void failNumber(std::string_view text, const char* why) const;
    template <class T, class ReadOne>
    void readMany(std::vector<T>& out, ReadOne readOne);

    std::shared_ptr<const Source> m_source;
    std::string_view m_text;
    size_t m_pos = 0;
};

/// A token as messages show it: quoted, on one line, not too long.
std::string describe(const Token& token);

/// Reads a whole file if the guard allows it. `where`: who asks for it, or nowhere for a file of the command
/// line.
std::shared_ptr<const Source> readSource(const std::filesystem::path& path,
                                         const std::filesystem::path& mainDirectory, const Location& where,
                                         std::shared_ptr<const ResourcePolicy> guard = nullptr);
/// A text in memory as a source called `name`.
std::shared_ptr<const Source> makeSource(std::string text, const std::filesystem::path& name,
                                         std::shared_ptr<const ResourcePolicy> guard = nullptr);

} // namespace strobe
