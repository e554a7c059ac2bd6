// Scenes with placeholders.
#pragma once

#include <initializer_list>
#include <string>
#include <utility>

namespace strobe::test {

/// Returns `text` with all occurrences of placeholders, such as "$material", replaced by their values.
inline std::string substitute(std::string text,
                              std::initializer_list<std::pair<std::string, std::string>> values) {
    for (const auto& [placeholder, value] : values)
        for (size_t i = 0; (i = text.find(placeholder, i)) != std::string::npos; i += value.size())
            text.replace(i, placeholder.size(), value);
    return text;
}

} // namespace strobe::test
