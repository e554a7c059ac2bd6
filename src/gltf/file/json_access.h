// Members of JSON values of any type, without exceptions. Used by the checks of conformance only.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace strobe::gltf {

using nlohmann::json;

/// Returns a member; null if it is missing or if `value` is no object.
inline const json& get(const json& value, const char* member) {
    static const json null;
    if (!value.is_object())
        return null;
    const auto it = value.find(member);
    return it == value.end() ? null : *it;
}

inline bool has(const json& value, const char* member) { return value.is_object() && value.contains(member); }

/// Returns a member that is an array; an empty one if it is missing or something else.
inline const json& listIn(const json& value, const char* member) {
    static const json empty = json::array();
    const json& found = get(value, member);
    return found.is_array() ? found : empty;
}

inline double number(const json& value, const char* member, double fallback) {
    const json& n = get(value, member);
    return n.is_number() ? n.get<double>() : fallback;
}

/// Returns items[index] of a list of the document's root; null if there is none.
inline const json& itemOf(const json& root, const char* list, const json& index) {
    const json& items = listIn(root, list);
    const bool exists = index.is_number_unsigned() && index.get<size_t>() < items.size();
    return exists ? items[index.get<size_t>()] : get(items, "");
}

/// Returns whether a list contains a string.
inline bool contains(const json& list, const std::string& name) {
    for (const json& item : list)
        if (item == name)
            return true;
    return false;
}

} // namespace strobe::gltf
