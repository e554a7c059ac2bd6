#include "integrators/vertex_clusters.h"

#include "core/hash.h"

#include <unordered_map>

namespace strobe {

namespace {

constexpr int kMaxLevels = 16;

/// Vertex normals: the mesh's own, or the mean of the faces around, weighted by area.
std::vector<V3f> vertexNormals(const TriangleMesh& mesh) {
    if (!mesh.normals.empty())
        return mesh.normals[0];
    std::vector<V3f> normals(mesh.vertexCount(), V3f(0));
    const auto& p = mesh.positions[0];
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const uint32_t* v = &mesh.indices[i];
        const V3f n = cross(p[v[1]] - p[v[0]], p[v[2]] - p[v[0]]);
        for (int k = 0; k < 3; ++k)
            normals[v[k]] += n;
    }
    return normals;
}

/// 0 … 5: the axis that `n` follows most, and which way.
uint64_t mainDirection(const V3f& n) {
    int axis = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(n[i]) > std::abs(n[axis]))
            axis = i;
    return uint64_t(2 * axis + (n[axis] < 0));
}

uint64_t cellOf(const V3f& p, float size, const V3f& normal) {
    const auto index = [&](float x) { return uint64_t(int64_t(std::floor(x / size))); };
    return hashOf(index(p.x), index(p.y), index(p.z), mainDirection(normal));
}

float meanEdge(const TriangleMesh& mesh) {
    const auto& p = mesh.positions[0];
    double sum = 0;
    for (size_t i = 0; i < mesh.indices.size(); i += 3)
        sum += length(p[mesh.indices[i + 1]] - p[mesh.indices[i]]);
    return float(sum / double(std::max<size_t>(mesh.triangleCount(), 1)));
}

} // namespace

VertexClusters::VertexClusters(const TriangleMesh& mesh) {
    m_triangle.assign(mesh.vertexCount(), 0);
    for (size_t i = mesh.indices.size(); i-- > 0;)
        m_triangle[mesh.indices[i]] = uint32_t(i / 3);

    const std::vector<V3f> normals = vertexNormals(mesh);
    const auto& positions = mesh.positions[0];
    m_finest = std::max(meanEdge(mesh), 1e-20f);
    std::vector<uint32_t> members(mesh.vertexCount()); // representatives of the level below
    for (uint32_t i = 0; i < members.size(); ++i)
        members[i] = i;
    std::unordered_map<uint64_t, uint32_t> groups;
    while (members.size() > 8 && m_levels.size() < kMaxLevels) {
        const float size = cellSize(int(m_levels.size()));
        Level level;
        groups.clear();
        groups.reserve(members.size());
        for (const uint32_t vertex : members) {
            const uint64_t cell = cellOf(positions[vertex], size, normals[vertex]);
            const auto [it, isNew] = groups.try_emplace(cell, uint32_t(level.vertexOf.size()));
            if (isNew)
                level.vertexOf.push_back(vertex);
            level.parent.push_back(it->second);
        }
        members = level.vertexOf;
        m_levels.push_back(std::move(level));
    }
}

int VertexClusters::levelFor(float size) const {
    const float nearest = size / m_finest * float(M_SQRT2);
    if (!(nearest >= 1))
        return -1;
    return std::min(std::ilogb(nearest), int(m_levels.size()) - 1);
}

uint32_t VertexClusters::representative(uint32_t vertex, int level) const {
    if (level < 0)
        return vertex;
    uint32_t group = vertex;
    for (int l = 0; l <= level; ++l)
        group = m_levels[size_t(l)].parent[group];
    return m_levels[size_t(level)].vertexOf[group];
}

} // namespace strobe
