// The lexer of the scene language. Numbers, most of a scene's text, are read into vectors without tokens.
#pragma once

#include "core/util/error.h"
#include "loader/parser/scene_values.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace strobe {

enum class TokenKind { End, Word, String, Number, Open, Close };

/// A token; `text` points into the source. The text of a String excludes the quotes and keeps escapes.
struct Token {
    TokenKind kind = TokenKind::End;
    size_t offset = 0;
    std::string_view text;
};

/// Reads the tokens of one source. White space and `#` comments separate tokens. $NAME outside of strings,
/// and $NAME or ${NAME} in them, are replaced by values; tokens of a value are located at the dollar sign.
/// All errors are located.
class Lexer {
  public:
    /// `values`: outlives the lexer and its tokens; null: there are none.
    explicit Lexer(std::shared_ptr<const Source> source, SceneValues* values = nullptr);

    /// Returns the kind of the next token, from its first character, without reading it.
    TokenKind peek();
    /// Reads a token of any kind; at the end of the text, always End.
    Token next();
    /// Reads a finite number. Precondition: the next token is a Number. A number below the type's range reads
    /// as 0; one above it is an Error.
    float readFloat();
    double readDouble();
    /// Reads a 32-bit integer. `3.0` and `1e3` are integers, `3.5` is an Error.
    int readInt();
    /// Appends all numbers up to the first other token.
    void readFloats(std::vector<float>& out);
    void readInts(std::vector<int>& out);
    /// Returns the text of a String token with its escapes (\n \t \" \\ …) and known values replaced.
    std::string unescape(const Token& token) const;

    Location at(size_t offset) const { return {m_source, offset}; }
    /// Returns the location of the next token.
    Location here() {
        skipBlanks();
        return at(offset());
    }
    const Source& source() const { return *m_source; }

  private:
    void skipBlanks();
    /// Enters the value of the name at the current position, or leaves one at its end.
    void beginValue();
    void endValue();
    /// Returns the length of the name, or the name in braces, after a dollar sign; 0 if there is none.
    static size_t nameLength(std::string_view text);
    /// Returns a text with the values of known names.
    std::string withValues(std::string text) const;
    /// Returns the current position in the source.
    size_t offset() const { return m_outer ? m_outer->dollar : m_pos; }
    Token readString();
    Token readWord();
    /// Returns the text from the current position up to the next delimiter.
    std::string_view numberText() const;
    [[noreturn]] void failNumber(std::string_view text, const char* why) const;
    template <class T, class ReadOne>
    void readMany(std::vector<T>& out, ReadOne readOne);

    std::shared_ptr<const Source> m_source;
    std::string_view m_text; ///< of the source, or of a value
    size_t m_pos = 0;        ///< in m_text
    /// The position in the source while a value is read.
    struct Outer {
        size_t dollar, next;
    };
    std::optional<Outer> m_outer;
    SceneValues* m_values;
};

/// Returns a token for messages: quoted, on one line, at most 40 characters of it.
std::string describe(const Token& token);

/// Reads a whole file, which may be packed by gzip, or standard input, if `where` is nowhere and
/// isStandardStream (path). `where`: the directive that names it; nowhere: the command line. `policy`: which
/// files may be read, and the memory limit; null: no restriction. Throws an Error at `where`.
std::shared_ptr<const Source> readSource(const std::filesystem::path& path,
                                         const std::filesystem::path& mainDirectory, const Location& where,
                                         std::shared_ptr<const ResourcePolicy> policy = nullptr);
/// Returns a text in memory as a source called `name`.
std::shared_ptr<const Source> makeSource(std::string text, const std::filesystem::path& name,
                                         std::shared_ptr<const ResourcePolicy> policy = nullptr);

} // namespace strobe
