// What layers call the things in a scene.
#pragma once

#include "core/scene/scene.h"

#include <map>
#include <string>
#include <vector>

namespace strobe {

/// The name of a part of an instance: "instance/part", or one of the two where the other is empty.
std::string joinedName(const std::string& instance, const std::string& part);

/// The next name for one of its kind: "kind#n", n from 1.
class Numbering {
  public:
    std::string next(const std::string& kind) { return kind + '#' + std::to_string(++m_counts[kind]); }

  private:
    std::map<std::string, int> m_counts;
};

/// Numbers all objects of a scene: shapes of the world each under its own name, and instances, whose parts
/// are objects of their own where they have names. Things of the same name are one object.
class ObjectNames {
  public:
    explicit ObjectNames(const Scene& scene);
    /// The object that was hit: an index into `names`. `hit` must not be empty.
    uint32_t operator()(const Hit& hit) const {
        return m_objects[m_first[hit.instance == kNone ? 0 : hit.instance + 1] + hit.geometry];
    }
    /// In the order of the scene.
    const std::vector<std::string>& names() const { return m_names; }

  private:
    std::vector<size_t> m_first;     ///< of the world, then of each instance: where its objects start
    std::vector<uint32_t> m_objects; ///< by geometry
    std::vector<std::string> m_names;
};

} // namespace strobe
