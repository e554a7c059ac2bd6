#include "shapes/subdivision.h"

#include "core/util/resource_policy.h"

#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <memory>
#include <string>

namespace strobe {
namespace {

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

/// Of topology and vertices while refining, at the finest level.
constexpr uint64_t kBytesPerTriangle = 225;
constexpr uint64_t kMaxTriangles = uint64_t(1) << 26; ///< 15 GB

/// Numbers the vertices that triangles use, in order; OpenSubdiv makes NaN of the others.
struct UsedVertices {
    std::vector<uint32_t> indices;  ///< of the triangles, renumbered
    std::vector<uint32_t> original; ///< what each used vertex was called before

    UsedVertices(const std::vector<uint32_t>& given, size_t vertexCount) {
        constexpr uint32_t kUnused = UINT32_MAX;
        std::vector<uint32_t> renumbered(vertexCount, kUnused);
        for (const uint32_t v : given)
            renumbered[v] = 0;
        for (uint32_t v = 0; v < vertexCount; ++v) {
            if (renumbered[v] == kUnused)
                continue;
            renumbered[v] = static_cast<uint32_t>(original.size());
            original.push_back(v);
        }
        for (const uint32_t v : given)
            indices.push_back(renumbered[v]);
    }
};

void requireSubdividable(const std::vector<uint32_t>& indices, int levels, const Location& where) {
    const uint64_t triangles = indices.size() / 3;
    if (levels < 0 || levels > 15 || (triangles << (2 * levels)) > kMaxTriangles)
        throw Error(where, "subdividing " + std::to_string(triangles) + " triangles " +
                               std::to_string(levels) + " times would make more than " +
                               std::to_string(kMaxTriangles));
    resourcePolicyOf(where).requireMemory(kBytesPerTriangle * (triangles << (2 * levels)),
                                          "subdividing " + std::to_string(triangles) + " triangles " +
                                              std::to_string(levels) + " times",
                                          "subdivide less often", where);
    for (size_t i = 0; i < indices.size(); i += 3) {
        if (indices[i] == indices[i + 1] || indices[i + 1] == indices[i + 2] || indices[i + 2] == indices[i])
            throw Error(where, "triangle " + std::to_string(i / 3) +
                                   " uses a vertex twice, so it cannot be subdivided");
    }
}

std::unique_ptr<Far::TopologyRefiner> refine(const std::vector<uint32_t>& indices, size_t vertexCount,
                                             int levels, const Location& where) {
    const std::vector<int> corners(indices.begin(), indices.end());
    const std::vector<int> cornersPerFace(indices.size() / 3, 3);
    Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(vertexCount);
    descriptor.numFaces = static_cast<int>(cornersPerFace.size());
    descriptor.numVertsPerFace = cornersPerFace.data();
    descriptor.vertIndicesPerFace = corners.data();

    // Sets tags only; the masks below are not OpenSubdiv's.
    Sdc::Options rules;
    rules.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    std::unique_ptr<Far::TopologyRefiner> refiner(
        Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_LOOP, rules)));
    if (!refiner)
        throw Error(where, "OpenSubdiv cannot make a surface of this mesh");
    Far::TopologyRefiner::UniformOptions options(levels);
    options.fullTopologyInLastLevel = true; // limits need the neighbors
    refiner->RefineUniform(options);
    return refiner;
}

std::vector<uint32_t> finestTriangles(const Far::TopologyRefiner& refiner) {
    const Far::TopologyLevel& level = refiner.GetLevel(refiner.GetMaxLevel());
    std::vector<uint32_t> indices;
    indices.reserve(3 * static_cast<size_t>(level.GetNumFaces()));
    for (int f = 0; f < level.GetNumFaces(); ++f) {
        for (const int v : {0, 1, 2})
            indices.push_back(static_cast<uint32_t>(level.GetFaceVertices(f)[v]));
    }
    return indices;
}

/// Vertices at which the limit has no normal (folded or collapsed neighborhoods) get the mean of their
/// triangles', so that shading never meets a zero normal that the triangles do not have themselves.
void replaceMissingNormals(const std::vector<uint32_t>& indices, const std::vector<V3f>& positions,
                           std::vector<V3f>& normals) {
    const auto missing = [](const V3f& n) { return !(length2(n) > 0) || !std::isfinite(length2(n)); };
    if (std::none_of(normals.begin(), normals.end(), missing))
        return;
    std::vector<V3f> sums(normals.size(), V3f(0));
    for (size_t i = 0; i < indices.size(); i += 3) {
        const V3f& p = positions[indices[i]];
        const V3f n = cross(positions[indices[i + 1]] - p, positions[indices[i + 2]] - p);
        for (const size_t corner : {i, i + 1, i + 2})
            sums[indices[corner]] += n;
    }
    for (size_t v = 0; v < normals.size(); ++v) {
        if (missing(normals[v]))
            normals[v] = sums[v];
    }
}

// OpenSubdiv keeps the topology, but the masks are pbrt's: Warren's weights at irregular vertices, where
// OpenSubdiv has Loop's, 1/5 for the limit of a boundary, and tangents of the points at the limit (see
// below). Half of the Killeroo's vertices are irregular; OpenSubdiv's normals differ from pbrt's by 3 degrees
// (RMS) on it at one level, and so would its picture.

/// Weight of each of n neighbors in refinement (Warren 1995, as in Pharr et al., "Physically Based
/// Rendering").
float refinementWeight(size_t n) { return n == 3 ? 3.f / 16 : 3.f / (8 * static_cast<float>(n)); }
constexpr float kBoundaryRefinementWeight = 1.f / 8;

/// Weight of each of n neighbors in the limit.
float limitWeight(size_t n) { return 1 / (static_cast<float>(n) + 3 / (8 * refinementWeight(n))); }
constexpr float kBoundaryLimitWeight = 1.f / 5;

/// The neighbors of a vertex, counter-clockwise; at a boundary from its one end to the other.
struct Ring {
    enum class Kind { Inner, Boundary, NonManifold } kind = Kind::Inner;
    std::vector<V3f> points; ///< unordered if not manifold

    void gather(const Far::TopologyLevel& level, int vertex, const std::vector<V3f>& positions) {
        kind = level.IsVertexNonManifold(vertex) ? Kind::NonManifold
               : level.IsVertexBoundary(vertex)  ? Kind::Boundary
                                                 : Kind::Inner;
        points.clear();
        const auto edges = level.GetVertexEdges(vertex);
        for (int i = 0; i < edges.size(); ++i) {
            const auto ends = level.GetEdgeVertices(edges[i]);
            points.push_back(positions[ends[0] == vertex ? ends[1] : ends[0]]);
        }
    }
    /// The center and its neighbors, weighted. Where sheets meet that are no surface, the center stays.
    V3f blend(const V3f& center, float innerWeight, float boundaryWeight) const {
        if (kind == Kind::NonManifold)
            return center;
        if (kind == Kind::Boundary)
            return center * (1 - 2 * boundaryWeight) + (points.front() + points.back()) * boundaryWeight;
        V3f sum(0);
        for (const V3f& p : points)
            sum += p;
        return center * (1 - static_cast<float>(points.size()) * innerWeight) + sum * innerWeight;
    }
    /// The cross product of two tangents; zero where there are none.
    V3f tangentNormal(const V3f& center) const {
        switch (kind) {
        case Kind::Inner:
            return innerNormal(center);
        case Kind::Boundary:
            return cross(points.front() - points.back(), inwardTangent(center));
        case Kind::NonManifold:
            break;
        }
        return V3f(0);
    }

  private:
    V3f innerNormal(const V3f& center) const {
        V3f s(0), t(0);
        for (size_t i = 0; i < points.size(); ++i) {
            const float angle = 2 * kPi * static_cast<float>(i) / static_cast<float>(points.size());
            s += (points[i] - center) * std::cos(angle); // the weights sum to 0: less to cancel
            t += (points[i] - center) * std::sin(angle);
        }
        return cross(s, t);
    }
    /// The tangent across a boundary, into the surface.
    V3f inwardTangent(const V3f& center) const {
        const size_t n = points.size();
        const V3f ends = points.front() + points.back();
        if (n == 2)
            return ends - center * 2;
        if (n == 3)
            return points[1] - center;
        if (n == 4)
            return (points[1] + points[2]) * 2 - ends - center * 2;
        const float theta = kPi / static_cast<float>(n - 1);
        V3f t = ends * -std::sin(theta);
        for (size_t k = 1; k + 1 < n; ++k)
            t += points[k] * ((2 - 2 * std::cos(theta)) * std::sin(static_cast<float>(k) * theta));
        return t;
    }
};

/// The point that divides an edge: 3/8 of its ends and 1/8 of the two corners across; else its middle.
V3f divideEdge(const Far::TopologyLevel& level, int edge, const std::vector<V3f>& points) {
    const auto ends = level.GetEdgeVertices(edge);
    const V3f sum = points[ends[0]] + points[ends[1]];
    const auto faces = level.GetEdgeFaces(edge);
    if (faces.size() != 2 || level.IsEdgeNonManifold(edge))
        return sum * 0.5f;
    V3f across(0);
    for (const int face : {faces[0], faces[1]}) {
        const auto corners = level.GetFaceVertices(face);
        for (const int v : {corners[0], corners[1], corners[2]}) {
            if (v != ends[0] && v != ends[1])
                across += points[v];
        }
    }
    return sum * (3.f / 8) + across * (1.f / 8);
}

std::vector<V3f> refineOnce(const Far::TopologyLevel& level, size_t finerCount,
                            const std::vector<V3f>& points) {
    std::vector<V3f> finer(finerCount);
    Ring ring;
    for (int v = 0; v < level.GetNumVertices(); ++v) {
        ring.gather(level, v, points);
        finer[level.GetVertexChildVertex(v)] =
            ring.blend(points[v], refinementWeight(ring.points.size()), kBoundaryRefinementWeight);
    }
    for (int e = 0; e < level.GetNumEdges(); ++e)
        finer[level.GetEdgeChildVertex(e)] = divideEdge(level, e, points);
    return finer;
}

/// Positions and normals of one key at the limit.
void subdivideKey(const Far::TopologyRefiner& refiner, const std::vector<V3f>& control,
                  const std::vector<uint32_t>& used, SubdividedMesh& mesh) {
    std::vector<V3f> points;
    for (const uint32_t v : used)
        points.push_back(control[v]);
    for (int level = 0; level < refiner.GetMaxLevel(); ++level)
        points = refineOnce(refiner.GetLevel(level), refiner.GetLevel(level + 1).GetNumVertices(), points);

    const Far::TopologyLevel& finest = refiner.GetLevel(refiner.GetMaxLevel());
    std::vector<V3f> limit(points.size()), normals(points.size());
    Ring ring;
    for (int v = 0; v < finest.GetNumVertices(); ++v) {
        ring.gather(finest, v, points);
        limit[v] = ring.blend(points[v], limitWeight(ring.points.size()), kBoundaryLimitWeight);
    }
    // pbrt applies the tangent masks to the points already moved, though they are made for those before.
    for (int v = 0; v < finest.GetNumVertices(); ++v) {
        ring.gather(finest, v, limit);
        normals[v] = ring.tangentNormal(limit[v]);
    }
    replaceMissingNormals(mesh.indices, limit, normals);
    mesh.positions.push_back(std::move(limit));
    mesh.normals.push_back(std::move(normals));
}

} // namespace

SubdividedMesh subdivideLoop(const std::vector<uint32_t>& indices, const std::vector<std::vector<V3f>>& keys,
                             int levels, const Location& where) {
    requireSubdividable(indices, levels, where);
    const UsedVertices used(indices, keys.front().size());
    const auto refiner = refine(used.indices, used.original.size(), levels, where);
    SubdividedMesh mesh;
    mesh.indices = finestTriangles(*refiner);
    for (const std::vector<V3f>& points : keys)
        subdivideKey(*refiner, points, used.original, mesh);
    return mesh;
}

} // namespace strobe
