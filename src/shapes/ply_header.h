// The header of a PLY file: its elements, their counts, and the types of their properties.
#pragma once

#include "core/util/error.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace strobe::ply {

/// The encoding of the numbers in the body.
enum class Format { Ascii, Little, Big };
/// The type of a number. The integer types precede the float types.
enum class Scalar { I8, U8, I16, U16, I32, U32, F32, F64 };

/// Returns the size of a binary number.
constexpr size_t byteSize(Scalar type) {
    constexpr size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[static_cast<int>(type)];
}

/// A column of an element: a number or a list of numbers per row.
struct Property {
    std::string name;
    Scalar type;
    std::optional<Scalar> listCount; ///< type of the count that precedes a list
};

/// A table of `count` rows.
struct Element {
    std::string name;
    uint64_t count;
    std::vector<Property> properties;
};

struct Header {
    Format format = Format::Ascii;
    std::vector<Element> elements;
    size_t size = 0; ///< bytes before the body

    /// Returns the element of this name, or null.
    const Element* find(std::string_view name) const {
        for (const Element& e : elements) {
            if (e.name == name)
                return &e;
        }
        return nullptr;
    }
};

/// A function that throws an Error at `where` that names the file. The referenced objects must outlive it.
struct Failure {
    const std::string& fileName;
    const Location& where;
    [[noreturn]] void operator()(const std::string& message) const {
        throw Error(where, "\"" + fileName + "\": " + message);
    }
};

/// Returns true for white space of the C locale.
inline bool isSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Returns a word in quotes for an error message: at most 32 characters, without control characters.
std::string quoteWord(std::string_view word);

/// Parses the header at the start of `contents`. Counts are not checked against the size of the file.
Header parseHeader(std::string_view contents, const Failure& fail);

} // namespace strobe::ply
