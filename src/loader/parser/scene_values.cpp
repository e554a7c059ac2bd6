#include "loader/parser/scene_values.h"

namespace strobe {

SceneValues::SceneValues(const std::vector<std::string>& defines) {
    for (const std::string& define : defines)
        if (const size_t equals = define.find('='); equals != std::string::npos)
            m_values[define.substr(0, equals)] = define.substr(equals + 1);
}

void SceneValues::setDefault(const std::string& name, const std::string& value) {
    m_values.try_emplace(name, value);
    m_used.insert(name);
}

const std::string* SceneValues::find(std::string_view name) {
    const auto it = m_values.find(name);
    if (it == m_values.end())
        return nullptr;
    m_used.insert(it->first);
    return &it->second;
}

std::map<std::string, std::string> SceneValues::used() const {
    std::map<std::string, std::string> used;
    for (const std::string& name : m_used)
        used[name] = m_values.find(name)->second;
    return used;
}

std::vector<std::string> SceneValues::names() const {
    std::vector<std::string> names;
    for (const auto& [name, value] : m_values)
        names.push_back(name);
    return names;
}

} // namespace strobe
