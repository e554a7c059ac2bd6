#include "core/scene/surface_ids.h"

#include "core/math/hash.h"

#include <bit>
#include <numeric>
#include <unordered_map>

namespace strobe {

namespace {

/// Unites the geometries of a group that are one surface.
class SurfaceFinder {
  public:
    SurfaceFinder(const Group& group, bool isBaked) : m_firsts(group.geometries.size()) {
        std::iota(m_firsts.begin(), m_firsts.end(), 0u);
        for (uint32_t i = 0; i < m_firsts.size(); ++i)
            if (isPart(group.geometries[i]))
                unite(i, group.geometries[i], isBaked);
    }
    /// Returns the first geometry of the surface, by geometry.
    std::vector<uint32_t> firsts() {
        for (uint32_t i = 0; i < m_firsts.size(); ++i)
            m_firsts[i] = firstOf(i);
        return std::move(m_firsts);
    }

  private:
    /// A larger mesh has enough light of its own.
    static bool isPart(const Geometry& geometry) {
        constexpr size_t kMaxTriangles = 8;
        const TriangleMesh* const mesh = geometry.placed.shape.mesh.get();
        return mesh && !mesh->deforms() && mesh->triangleCount() <= kMaxTriangles && geometry.light < 0;
    }
    uint32_t firstOf(uint32_t i) {
        while (m_firsts[i] != i)
            i = m_firsts[i] = m_firsts[m_firsts[i]];
        return i;
    }
    void unite(uint32_t index, const Geometry& geometry, bool isBaked) {
        const PlacedShape& placed = geometry.placed;
        for (const V3f& position : placed.shape.mesh->positions[0]) {
            const V3f p = isBaked ? position : transformPoint(placed.toParent, position);
            const auto bits = [](float x) { return uint64_t(std::bit_cast<uint32_t>(x + 0.f)); }; // no -0
            const uint64_t key =
                hashOf(bits(p.x) << 32 | bits(p.y), bits(p.z) << 32 | uint32_t(geometry.material),
                       std::bit_cast<uint64_t>(placed.motion.get()));
            const uint32_t a = firstOf(m_byVertex.try_emplace(key, index).first->second), b = firstOf(index);
            m_firsts[std::max(a, b)] = std::min(a, b);
        }
    }

    std::vector<uint32_t> m_firsts; ///< an earlier geometry of the surface, or the geometry itself
    std::unordered_map<uint64_t, uint32_t> m_byVertex;
};

} // namespace

SurfaceIds::SurfaceIds(const std::vector<Group>& groups, const std::vector<Instance>& instances)
    : m_instances(instances) {
    for (const Group& group : groups)
        m_firsts.push_back(SurfaceFinder(group, m_firsts.empty()).firsts());
}

} // namespace strobe
