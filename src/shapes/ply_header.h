// The header of a PLY file: which elements there are, how many, and the types of their properties.
#pragma once

#include "core/util/error.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace strobe::ply {

/// How the numbers of the body are written.
enum class Format { Ascii, Little, Big };
/// Type of a number; the integers come first.
enum class Scalar { I8, U8, I16, U16, I32, U32, F32, F64 };

/// Of a binary number.
constexpr size_t byteSize(Scalar type) {
    constexpr size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[static_cast<int>(type)];
}

/// A column of an element: one number per row, or a list of them.
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

/// The whole header.
struct Header {
    Format format = Format::Ascii;
    std::vector<Element> elements;
    size_t size = 0; ///< bytes up to the first of the body

    /// Null when there is none.
    const Element* find(std::string_view name) const {
        for (const Element& e : elements) {
            if (e.name == name)
                return &e;
        }
        return nullptr;
    }
};

/// Throws a message at `where` about the file called `fileName`. The two must outlive it.
struct Failure {
    const std::string& fileName;
    const Location& where;
    [[noreturn]] void operator()(const std::string& message) const {
        throw Error(where, "\"" + fileName + "\": " + message);
    }
};

/// What the C locale calls white space.
inline bool isSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// A word as an error message shows it: short, and without bytes that a terminal would act on.
std::string shown(std::string_view word);

/// Reads the header at the start of `contents`. Counts are what the file claims, unchecked.
Header parseHeader(std::string_view contents, const Failure& fail);

} // namespace strobe::ply
