// The values that scene files name as $NAME.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace strobe {

/// Texts by name: of the command line, or defaults that the scene declares. Pointers to texts stay valid.
class SceneValues {
  public:
    SceneValues() = default;
    /// `defines`: texts NAME=VALUE, which override defaults; others are ignored.
    explicit SceneValues(const std::vector<std::string>& defines);

    void setDefault(const std::string& name, const std::string& value);
    /// Returns the value, which counts as used; null if the name is unknown.
    const std::string* find(std::string_view name);
    /// Returns the names and values that the scene has used or declared.
    std::map<std::string, std::string> used() const;
    std::vector<std::string> names() const;

  private:
    std::map<std::string, std::string, std::less<>> m_values;
    std::set<std::string, std::less<>> m_used;
};

} // namespace strobe
