// The scene language: any bytes give a scene or a located Error, and what is small is built, too. Mutations
// keep to the language: they move, repeat, drop and exchange words and directives.
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

constexpr size_t kMostToBuild = 4096; ///< bytes

/// Words, strings, brackets and comments with the blanks after them: put together, they are the text again.
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
            while (end < text.size() && !isBlank(text[end]) && !std::strchr("\"#[]", text[end]))
                ++end;
        while (end < text.size() && isBlank(text[end]))
            ++end;
        tokens.push_back(text.substr(i, end - i));
        i = end;
    }
    return tokens;
}

bool isDirective(const std::string& token) { return token[0] >= 'A' && token[0] <= 'Z'; }

/// From a directive up to the next one.
std::pair<size_t, size_t> directiveAt(const std::vector<std::string>& tokens, size_t at) {
    size_t first = at, end = at + 1;
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
    "AttributeBegin\n",
    "AttributeEnd\n",
    "WorldBegin\n",
    "ObjectBegin \"a\"\n",
    "ObjectEnd\n",
    "ObjectInstance \"a\"\n",
    "TransformBegin\n",
    "TransformEnd\n",
    "ReverseOrientation\n",
    "Identity\n",
    "Translate 1 2 3\n",
    "Scale 1 -1 2\n",
    "Rotate 30 0 1 0\n",
    "ActiveTransform EndTime\n",
    "ActiveTransform All\n",
    "Shape \"sphere\" \"float radius\" 1\n",
    "Shape \"disk\" \"float height\" 1\n",
    "LightSource \"point\" \"rgb I\" [1 1 1]\n",
    "LightSource \"infinite\"\n",
    "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n",
    "Material \"glass\" \"float index\" 1.5\n",
    "Material \"matte\" \"texture Kd\" \"t\"\n",
    "Texture \"t\" \"rgb\" \"checkerboard\" \"float uscale\" 4\n",
    "MakeNamedMaterial \"m\" \"string type\" \"plastic\"\n",
    "NamedMaterial \"m\"\n",
    "Integrator \"path\"\n",
    "Integrator \"msaa-cache\"\n",
    "Sampler \"stratified\"\n",
    "Camera \"perspective\" \"float fov\" 40\n",
    "TransformTimes 0 .5 1\n",
    "CoordinateSystem \"c\"\n",
    "CoordSysTransform \"c\"\n",
    "Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n",
    "Shape \"loopsubdiv\" \"integer nlevels\" 1 \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 "
    "2]\n"};

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
            m_tokens.insert(at(below(m_tokens.size() + 1)), kDirectives[below(kDirectives.size())]);
            return;
        }
        const size_t i = below(m_tokens.size()), k = below(m_tokens.size());
        const auto [first, end] = directiveAt(m_tokens, i);
        switch (below(7)) {
        case 0: // a number becomes another
            for (size_t n = 0; n < m_tokens.size(); ++n)
                if (std::string& token = m_tokens[(i + n) % m_tokens.size()];
                    std::strchr("0123456789-.+", token[0])) {
                    token = kNumbers[below(kNumbers.size())];
                    break;
                }
            break;
        case 1: // a directive again, elsewhere
        {
            const std::vector<std::string> copy(at(first), at(end));
            m_tokens.insert(at(k), copy.begin(), copy.end());
            break;
        }
        case 2:
            m_tokens.erase(at(first), at(end));
            break;
        case 3:
            m_tokens.erase(at(i));
            break;
        case 4:
            std::swap(m_tokens[i], m_tokens[k]);
            break;
        case 5: // one word in place of another of its kind
            for (size_t n = 0; n < m_tokens.size(); ++n)
                if (const std::string& other = m_tokens[(k + n) % m_tokens.size()];
                    (other[0] == '"') == (m_tokens[i][0] == '"') && other != m_tokens[i]) {
                    m_tokens[i] = other;
                    break;
                }
            break;
        default:
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
    // Other renderers' files are read with other rules, and make plugins of other names.
    for (const char* name : {"fuzz.scene", "fuzz.pbrt"}) {
        Diagnostics quiet;
        try {
            SceneDescription description =
                parseText(text, name, {"supersample", "msaa", "msaa-cache"}, quiet, fuzzGuard());
            if (size <= kMostToBuild)
                buildSmall(std::move(description), quiet);
        } catch (const Error& e) {
            formatDiagnostic(e.location, "error", e.what());
        }
    }
    return 0;
}
