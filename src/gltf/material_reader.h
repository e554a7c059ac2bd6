// Reads numbers, colors and texture references of materials.
#pragma once

#include "gltf/texture.h"

#include <algorithm>

namespace strobe::gltf {

/// Reads the members of a material.
class MaterialReader {
  public:
    MaterialReader(const Document& document, std::string jsonPath)
        : m_document(document), m_place(std::move(jsonPath)) {}

    /// Returns the number `member` of an object; `fallback` if there is none.
    float number(const tinygltf::Value& object, const char* member, float fallback) const {
        if (!object.Has(member))
            return fallback;
        if (!object.Get(member).IsNumber())
            m_document.fail(m_place + "." + member, "must be a number");
        return float(object.Get(member).GetNumberAsDouble());
    }
    /// Returns the color `member` of an object; `fallback` if there is none.
    Rgb color(const tinygltf::Value& object, const char* member, const Rgb& fallback) const {
        if (!object.Has(member))
            return fallback;
        std::vector<double> numbers;
        const tinygltf::Value& list = object.Get(member);
        for (size_t i = 0; i < list.ArrayLen(); ++i)
            if (list.Get(int(i)).IsNumber())
                numbers.push_back(list.Get(int(i)).GetNumberAsDouble());
        return color(numbers, member, 3);
    }
    /// Returns the first three of `count` non-negative numbers.
    Rgb color(const std::vector<double>& numbers, const char* member, size_t count) const {
        if (numbers.size() != count ||
            std::any_of(numbers.begin(), numbers.end(), [](double x) { return x < 0; }))
            m_document.fail(m_place + "." + member,
                            "must be " + std::to_string(count) + " non-negative numbers");
        return {float(numbers[0]), float(numbers[1]), float(numbers[2])};
    }
    /// Returns the texture reference `member`.
    template <class Info>
    TextureSlot slot(const Info& info, const char* member) const {
        return slotFrom(m_document, info, m_place + "." + member);
    }
    TextureSlot slot(const tinygltf::Value& object, const char* member) const {
        return slotFrom(m_document, object, member, m_place);
    }

  private:
    const Document& m_document;
    std::string m_place;
};

} // namespace strobe::gltf
