// Names of the objects of a scene, for object ids and Cryptomatte.
#pragma once

#include "core/math/api.h"
#include "core/scene/scene.h"

#include <map>
#include <string>
#include <vector>

namespace STROBE_API strobe {

/// Returns the name of an object within an instance: "instance/object", or one name if the other is empty.
std::string joinedName(const std::string& instance, const std::string& object);

/// Generates names for unnamed objects: "kind#n", with n from 1 for each kind.
class Numbering {
  public:
    std::string next(const std::string& kind) { return kind + '#' + std::to_string(++m_counts[kind]); }

  private:
    std::map<std::string, int> m_counts;
};

/// The objects of a scene, numbered. A shape outside of instances is an object with the name of the shape. An
/// instance is one object, and each of its shapes that has a name is an object of its own (`joinedName`).
/// Shapes with the same resulting name are one object.
class ObjectNames {
  public:
    explicit ObjectNames(const Scene& scene);
    /// Returns the object that was hit, as an index into `names`. `hit` must not be empty.
    uint32_t operator()(const Hit& hit) const {
        return m_objects[m_first[hit.instance == kNone ? 0 : hit.instance + 1] + hit.geometry];
    }
    /// The names of all objects, in the order of the scene.
    const std::vector<std::string>& names() const { return m_names; }

  private:
    std::vector<size_t> m_first;     ///< into m_objects: the first geometry of group 0, then of each instance
    std::vector<uint32_t> m_objects; ///< into m_names, per geometry
    std::vector<std::string> m_names;
};

} // namespace strobe
