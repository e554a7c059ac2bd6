// Fuzzes the parser and, with small scenes, the builder: any bytes give a scene or a located Error. The
// mutator moves, repeats, deletes and exchanges tokens and directives.
#include "fuzz_file.h"
#include "fuzz_scene.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

using namespace strobe;

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t maxSize);

namespace {

constexpr size_t kMaxBytesToBuild = 4096;

/// Splits a text into words, strings, brackets and comments, each with the blanks after it. Their
/// concatenation is the text.
std::vector<std::string> tokensOf(const std::string& text) {
    std::vector<std::string> tokens;
    const auto isBlank = [](char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; };
    for (size_t i = 0; i < text.size();) {
        size_t end = i + 1;
        if (text[i] == '"')
            end = std::min(text.find('"', i + 1), text.size() - 1) + 1;
        else if (text[i] == '#')
            end = std::min(text.find('\n', i), text.size());
        else if (!std::strchr("[]", text[i]))
            while (end < text.size() && !isBlank(text[end]) && !std::strchr(R"("#[])", text[end]))
                ++end;
        while (end < text.size() && isBlank(text[end]))
            ++end;
        tokens.push_back(text.substr(i, end - i));
        i = end;
    }
    return tokens;
}

bool isDirective(const std::string& token) { return token[0] >= 'A' && token[0] <= 'Z'; }

/// Returns the range of tokens of the directive that includes token `index`, up to the next directive.
std::pair<size_t, size_t> directiveRange(const std::vector<std::string>& tokens, size_t index) {
    size_t first = index;
    size_t end = index + 1;
    while (first > 0 && !isDirective(tokens[first]))
        --first;
    while (end < tokens.size() && !isDirective(tokens[end]))
        ++end;
    return {first, end};
}

constexpr std::array kNumbers{"0 ",           "1 ",          "-1 ",    "1e30 ",    "-1e-30 ",
                              "0.5 ",         "3 ",          "1e38 ",  "1e-45 ",   "2147483647 ",
                              "-2147483648 ", "4294967296 ", "65536 ", "1000000 ", "1e999 ",
                              "nan ",         "inf ",        "90 ",    "16 "};
constexpr std::array kDirectives{
    "AttributeBegin",
    "AttributeEnd",
    "WorldBegin",
    R"(ObjectBegin "a")",
    "ObjectEnd",
    R"(ObjectInstance "a")",
    "TransformBegin",
    "TransformEnd",
    "ReverseOrientation",
    "Identity",
    "Translate 1 2 3",
    "Scale 1 -1 2",
    "Rotate 30 0 1 0",
    "ActiveTransform EndTime",
    "ActiveTransform All",
    R"(Shape "sphere" "float radius" 1)",
    R"(Shape "disk" "float height" 1)",
    R"(LightSource "point" "rgb I" [1 1 1])",
    R"(LightSource "infinite")",
    R"(AreaLightSource "diffuse" "rgb L" [1 1 1])",
    R"(Material "glass" "float index" 1.5)",
    R"(Material "matte" "texture Kd" "t")",
    R"(Texture "t" "rgb" "checkerboard" "float uscale" 4)",
    R"(MakeNamedMaterial "m" "string type" "plastic")",
    R"(NamedMaterial "m")",
    R"(Integrator "path")",
    R"(Integrator "msaa-cache")",
    R"(Sampler "stratified")",
    R"(Camera "perspective" "float fov" 40)",
    "TransformTimes 0 .5 1",
    R"(CoordinateSystem "c")",
    R"(CoordSysTransform "c")",
    R"(Shape "trianglemesh" "point P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2])",
    R"(Shape "loopsubdiv" "integer nlevels" 1 "point P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2])"};

class Mutator {
  public:
    Mutator(std::vector<std::string> tokens, unsigned seed) : m_tokens(std::move(tokens)), m_random(seed) {}

    std::string mutated() {
        for (size_t i = 0; i <= below(3); ++i)
            mutate();
        std::string text;
        for (const std::string& token : m_tokens)
            text += token;
        return text;
    }

  private:
    size_t below(size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(m_random); }
    auto at(size_t i) { return m_tokens.begin() + ptrdiff_t(i); }

    void mutate() {
        if (m_tokens.empty() || below(6) == 0) {
            m_tokens.insert(at(below(m_tokens.size() + 1)),
                            std::string(kDirectives[below(kDirectives.size())]) + '\n');
            return;
        }
        const size_t i = below(m_tokens.size()), k = below(m_tokens.size());
        const auto [first, end] = directiveRange(m_tokens, i);
        switch (below(7)) {
        case 0: // replace a number
            for (size_t n = 0; n < m_tokens.size(); ++n)
                if (std::string& token = m_tokens[(i + n) % m_tokens.size()];
                    std::strchr("0123456789-.+", token[0])) {
                    token = kNumbers[below(kNumbers.size())];
                    break;
                }
            break;
        case 1: // copy a directive
        {
            const std::vector<std::string> copy(at(first), at(end));
            m_tokens.insert(at(k), copy.begin(), copy.end());
            break;
        }
        case 2: // delete a directive
            m_tokens.erase(at(first), at(end));
            break;
        case 3: // delete a token
            m_tokens.erase(at(i));
            break;
        case 4: // exchange two tokens
            std::swap(m_tokens[i], m_tokens[k]);
            break;
        case 5: // replace a token by another of its kind
            for (size_t n = 0; n < m_tokens.size(); ++n)
                if (const std::string& other = m_tokens[(k + n) % m_tokens.size()];
                    (other[0] == '"') == (m_tokens[i][0] == '"') && other != m_tokens[i]) {
                    m_tokens[i] = other;
                    break;
                }
            break;
        default: // repeat a token
            m_tokens.insert(at(i), std::string(m_tokens[i]));
        }
    }

    std::vector<std::string> m_tokens;
    std::minstd_rand m_random;
};

} // namespace

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t maxSize, unsigned seed) {
    if (seed % 4 == 0)
        return LLVMFuzzerMutate(data, size, maxSize);
    const std::string text =
        Mutator(tokensOf(std::string(reinterpret_cast<const char*>(data), size)), seed).mutated();
    const size_t length = std::min(text.size(), maxSize);
    std::memcpy(data, text.data(), length);
    return length;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string text(reinterpret_cast<const char*>(data), size);
    // .pbrt files are parsed in lenient mode and use compatibility plugins.
    for (const char* name : {"fuzz.scene", "fuzz.pbrt"}) {
        Diagnostics quiet;
        try {
            SceneDescription description =
                parseText(text, name, {"supersample", "msaa", "msaa-cache"}, quiet, fuzzGuard());
            if (size <= kMaxBytesToBuild)
                buildSmall(std::move(description), quiet);
        } catch (const Error& e) {
            formatDiagnostic(e.location, "error", e.what());
        }
    }
    return 0;
}
