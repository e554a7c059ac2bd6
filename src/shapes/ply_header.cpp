#include "shapes/ply_header.h"

#include <array>
#include <charconv>

namespace strobe::ply {
namespace {

class HeaderParser {
  public:
    HeaderParser(std::string_view text, const Failure& fail) : m_text(text), m_fail(fail) {}

    Header parse() {
        if (nextLine() != std::vector<std::string_view>{"ply"})
            m_fail("is not a PLY file (it does not start with the line \"ply\")");
        parseFormat(nextLine());
        for (auto words = nextLine(); words.empty() || words[0] != "end_header"; words = nextLine())
            parseLine(words);
        m_header.size = m_pos;
        return std::move(m_header);
    }

  private:
    /// Returns the words of the next line. Lines end with \n or \r\n.
    std::vector<std::string_view> nextLine() {
        const size_t end = m_text.find('\n', m_pos);
        if (end == std::string_view::npos)
            m_fail("the header has no end (no line \"end_header\")");
        const std::string_view line = m_text.substr(m_pos, end - m_pos);
        m_pos = end + 1;
        std::vector<std::string_view> words;
        for (size_t i = 0; i < line.size();) {
            size_t stop = i;
            while (stop < line.size() && !isSpace(line[stop]))
                ++stop;
            if (stop > i)
                words.push_back(line.substr(i, stop - i));
            i = stop + 1;
        }
        return words;
    }

    void parseFormat(const std::vector<std::string_view>& words) {
        if (words.size() != 3 || words[0] != "format")
            m_fail("the second line of the header must be \"format ...\"");
        if (words[2] != "1.0")
            m_fail("format version " + quoteWord(words[2]) + " is not 1.0");
        if (words[1] == "ascii")
            m_header.format = Format::Ascii;
        else if (words[1] == "binary_little_endian")
            m_header.format = Format::Little;
        else if (words[1] == "binary_big_endian")
            m_header.format = Format::Big;
        else
            m_fail("unknown format " + quoteWord(words[1]) +
                   " (known: ascii, binary_little_endian, binary_big_endian)");
    }

    void parseLine(const std::vector<std::string_view>& words) {
        if (words.empty() || words[0] == "comment" || words[0] == "obj_info")
            return;
        if (words[0] == "element" && words.size() == 3)
            return addElement(words[1], words[2]);
        if (words[0] == "property" && words.size() == 3)
            return addProperty({std::string(words[2]), scalar(words[1]), {}});
        if (words[0] == "property" && words.size() == 5 && words[1] == "list")
            return addProperty({std::string(words[4]), scalar(words[3]), scalar(words[2])});
        m_fail("the header has an invalid line that starts with " + quoteWord(words[0]));
    }

    void addElement(std::string_view name, std::string_view countText) {
        uint64_t count = 0;
        const char* end = countText.data() + countText.size();
        const auto [stop, error] = std::from_chars(countText.data(), end, count);
        if (error != std::errc() || stop != end)
            m_fail("the count of element " + quoteWord(name) + " is not a number: " + quoteWord(countText));
        if (m_header.find(name))
            m_fail("element " + quoteWord(name) + " is declared twice");
        m_header.elements.push_back({std::string(name), count, {}});
    }

    void addProperty(Property property) {
        if (m_header.elements.empty())
            m_fail("property " + quoteWord(property.name) + " comes before any element");
        Element& element = m_header.elements.back();
        for (const Property& other : element.properties) {
            if (other.name == property.name)
                m_fail("property " + quoteWord(property.name) + " of element " + quoteWord(element.name) +
                       " is declared twice");
        }
        if (property.listCount && *property.listCount >= Scalar::F32)
            m_fail("the count of list " + quoteWord(property.name) + " must be of an integer type");
        element.properties.push_back(std::move(property));
    }

    Scalar scalar(std::string_view name) const {
        static constexpr std::array<std::array<std::string_view, 2>, 8> names{{{"char", "int8"},
                                                                               {"uchar", "uint8"},
                                                                               {"short", "int16"},
                                                                               {"ushort", "uint16"},
                                                                               {"int", "int32"},
                                                                               {"uint", "uint32"},
                                                                               {"float", "float32"},
                                                                               {"double", "float64"}}};
        for (size_t i = 0; i < names.size(); ++i) {
            if (name == names[i][0] || name == names[i][1])
                return static_cast<Scalar>(i);
        }
        m_fail("unknown property type " + quoteWord(name));
    }

    std::string_view m_text;
    const Failure& m_fail;
    size_t m_pos = 0;
    Header m_header;
};

} // namespace

std::string quoteWord(std::string_view word) {
    std::string s(word.substr(0, 32));
    for (char& c : s) {
        if (c < ' ' || c > '~')
            c = '?';
    }
    return "\"" + s + (word.size() > 32 ? "...\"" : "\"");
}

Header parseHeader(std::string_view contents, const Failure& fail) {
    return HeaderParser(contents, fail).parse();
}

} // namespace strobe::ply
