#include "loader/parser/lexer.h"

#include "support/scene_text.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

using namespace strobe;

namespace {

std::string errorOf(const std::string& text, void (*read)(Lexer&)) {
    Lexer lexer(makeSource(text, "t"));
    try {
        read(lexer);
    } catch (const Error& e) {
        return e.location.toString() + " " + e.what();
    }
    return "";
}

std::vector<float> floatsOf(const std::string& text) {
    Lexer lexer(makeSource(text, "t"));
    std::vector<float> numbers;
    lexer.readFloats(numbers);
    return numbers;
}

TEST(Lexer, TokensWithOffsets) {
    Lexer lexer(makeSource("\xEF\xBB\xBFShape # comment \"not a string\"\n\"two words\"[-1.5]", "t"));
    const std::vector<std::pair<TokenKind, std::string>> expected{
        {TokenKind::Word, "Shape"},  {TokenKind::String, "two words"}, {TokenKind::Open, "["},
        {TokenKind::Number, "-1.5"}, {TokenKind::Close, "]"},          {TokenKind::End, ""},
        {TokenKind::End, ""}};
    for (const auto& [kind, text] : expected) {
        EXPECT_EQ(lexer.peek(), kind);
        const Token token = lexer.next();
        EXPECT_EQ(token.kind, kind);
        EXPECT_EQ(token.text, text);
    }
}

TEST(Lexer, CommentMayEndTheText) {
    Lexer lexer(makeSource("1 # the end", "t"));
    EXPECT_EQ(lexer.readFloat(), 1);
    EXPECT_EQ(lexer.peek(), TokenKind::End);
    EXPECT_EQ(Lexer(makeSource("#", "t")).peek(), TokenKind::End);
    EXPECT_EQ(Lexer(makeSource("", "t")).peek(), TokenKind::End);
}

TEST(Lexer, FloatSpellings) {
    EXPECT_EQ(floatsOf("1 -2.5 +3 .5 -.5 5. 1e3 1E-2 -0 16777217 1e-60 "
                       "0.00000000000000000000000000000000000000000000000001"),
              (std::vector<float>{1, -2.5f, 3, .5f, -.5f, 5, 1000, .01f, -0.f, 16777216, 0, 0}));
}

TEST(Lexer, FloatsAreCorrectlyRounded) {
    std::mt19937 random(1);
    for (int i = 0; i < 20000; ++i) {
        uint32_t bits = static_cast<uint32_t>(random());
        float expected;
        std::memcpy(&expected, &bits, 4);
        if (!std::isfinite(expected) || std::abs(expected) < 1e-37f)
            continue;
        char text[64];
        std::snprintf(text, sizeof text, "%.9g", expected);
        ASSERT_EQ(floatsOf(text), std::vector<float>{expected}) << text;
    }
}

TEST(Lexer, LongListsAreComplete) {
    std::string text;
    for (int i = 0; i < 20000; ++i)
        text += std::to_string(i) + (i % 3 ? " " : "\n# ] 7\n");
    Lexer lexer(makeSource(text + "]", "t"));
    std::vector<int> numbers;
    lexer.readInts(numbers);
    ASSERT_EQ(numbers.size(), 20000u);
    for (int i = 0; i < 20000; ++i)
        ASSERT_EQ(numbers[i], i);
    EXPECT_EQ(lexer.next().kind, TokenKind::Close);
}

TEST(Lexer, BadNumbers) {
    const auto readFloat = [](Lexer& l) { l.readFloat(); };
    EXPECT_EQ(errorOf(" 1.2.3", readFloat), "t:1:2 '1.2.3' is not a number");
    EXPECT_EQ(errorOf("-nan", readFloat), "t:1:1 '-nan' is not a number");
    EXPECT_EQ(errorOf("+inf", readFloat), "t:1:1 '+inf' is not a number");
    EXPECT_EQ(errorOf("-", readFloat), "t:1:1 '-' is not a number");
    EXPECT_EQ(errorOf("+-1", readFloat), "t:1:1 '+-1' is not a number");
    EXPECT_EQ(errorOf("0x10", readFloat), "t:1:1 '0x10' is not a number");
    EXPECT_EQ(errorOf("1,2", readFloat), "t:1:1 '1,2' is not a number");
    EXPECT_EQ(errorOf("1e39", readFloat), "t:1:1 '1e39' is too large for a 32-bit float");
    EXPECT_EQ(errorOf("-1e999", readFloat), "t:1:1 '-1e999' is too large for a 32-bit float");
}

TEST(Lexer, Integers) {
    const auto readInt = [](Lexer& l) { l.readInt(); };
    Lexer lexer(makeSource("7 -2147483648 3.0 1e3 +5", "t"));
    std::vector<int> numbers;
    lexer.readInts(numbers);
    EXPECT_EQ(numbers, (std::vector<int>{7, -2147483648, 3, 1000, 5}));
    EXPECT_EQ(errorOf("3.5", readInt), "t:1:1 '3.5' is not an integer");
    EXPECT_EQ(errorOf("2147483648", readInt), "t:1:1 '2147483648' does not fit a 32-bit integer");
    EXPECT_EQ(errorOf("99999999999999999999", readInt),
              "t:1:1 '99999999999999999999' does not fit a 32-bit integer");
    EXPECT_EQ(errorOf("12x", readInt), "t:1:1 '12x' is not a number");
}

TEST(Lexer, Strings) {
    Lexer lexer(makeSource(R"("a\"b\\c\n" "\q")", "t"));
    EXPECT_EQ(lexer.unescape(lexer.next()), R"(a"b\c
)");
    const Token bad = lexer.next();
    EXPECT_THROW(lexer.unescape(bad), Error);
    const auto next = [](Lexer& l) { l.next(); };
    EXPECT_EQ(errorOf(R"("abc
")",
                      next),
              "t:1:1 string without a closing quote on the same line");
    EXPECT_EQ(errorOf(R"("abc\)", next), "t:1:1 string without a closing quote on the same line");
    EXPECT_EQ(errorOf(R"("abc\")", next), "t:1:1 string without a closing quote on the same line");
}

TEST(Lexer, UnexpectedCharacters) {
    const auto next = [](Lexer& l) { l.next(); };
    EXPECT_EQ(errorOf("\x89PNG", next), "t:1:1 unexpected byte 0x89; is this a text file?");
    EXPECT_EQ(errorOf(std::string(1, '\0'), next), "t:1:1 unexpected byte 0x00; is this a text file?");
    EXPECT_EQ(errorOf("{", next), "t:1:1 unexpected character '{'");
}

TEST(Source, ReadsFilesOrThrows) {
    const test::TemporaryFolder folder;
    const auto path = folder.write("a.scene", "abc");
    EXPECT_EQ(readSource(path, folder.path(), {})->text, "abc");
    EXPECT_EQ(readSource(folder.write("empty.scene", ""), folder.path(), {})->text, "");
    EXPECT_THROW(readSource(folder.path(), folder.path(), {}), Error);
    try {
        readSource("no/such.scene", "no", {});
        FAIL();
    } catch (const Error& e) {
        EXPECT_STREQ(e.what(), R"(cannot read "no/such.scene": No such file or directory)");
        EXPECT_EQ(e.kind, ErrorKind::Usage);
    }
}

} // namespace
