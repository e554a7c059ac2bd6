#include "core/scene/object_names.h"

#include <unordered_map>

namespace strobe {

std::string joinedName(const std::string& instance, const std::string& object) {
    return instance.empty() || object.empty() ? instance + object : instance + '/' + object;
}

ObjectNames::ObjectNames(const Scene& scene) {
    std::unordered_map<std::string, uint32_t> indexOfName;
    const auto add = [&](const std::string& instance, uint32_t group) {
        m_first.push_back(m_objects.size());
        for (const Geometry& geometry : scene.groups()[group].geometries) {
            std::string name = joinedName(instance, geometry.name);
            const auto [it, isNew] = indexOfName.emplace(name, uint32_t(m_names.size()));
            if (isNew)
                m_names.push_back(std::move(name));
            m_objects.push_back(it->second);
        }
    };
    add("", 0);
    for (const Instance& instance : scene.instances())
        add(instance.name, instance.group);
}

} // namespace strobe
