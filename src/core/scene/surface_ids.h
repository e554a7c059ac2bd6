// Numbers of surfaces, which may consist of several meshes.
#pragma once

#include "core/scene/tracer.h"

#include <vector>

namespace strobe {

/// Numbers the surfaces of a scene. Files often divide an object into many meshes, down to single triangles:
/// small meshes of one material that move alike and have vertices in common are one surface, in each instance
/// and outside of instances. All other shapes are surfaces of their own.
class SurfaceIds {
  public:
    /// The instances outlive the object.
    SurfaceIds(const std::vector<Group>& groups, const std::vector<Instance>& instances);
    /// Returns a number that all hits on one surface have in common. `hit` must not be empty.
    uint64_t of(const Hit& hit) const {
        const uint32_t group = hit.instance == kNone ? 0 : m_instances[hit.instance].group;
        return uint64_t(hit.instance) << 32 | m_firsts[group][hit.geometry];
    }

  private:
    const std::vector<Instance>& m_instances;
    std::vector<std::vector<uint32_t>> m_firsts; ///< the first geometry of the surface, by group and geometry
};

} // namespace strobe
