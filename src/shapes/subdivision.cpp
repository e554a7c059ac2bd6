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

/// Memory for topology and vertices during refinement, per triangle of the finest level.
constexpr uint64_t kBytesPerTriangle = 225;
constexpr uint64_t kMaxTriangles = uint64_t(1) << 26; ///< 15 GB

/// A renumbering of the used vertices in order; OpenSubdiv produces NaN for unused vertices.
struct UsedVertices {
    std::vector<uint32_t> indices;  ///< renumbered indices of the triangles
    std::vector<uint32_t> original; ///< original index of each used vertex

    UsedVertices(const std::vector<uint32_t>& originalIndices, size_t vertexCount) {
        constexpr uint32_t kUnused = UINT32_MAX;
        std::vector<uint32_t> renumbered(vertexCount, kUnused);
        for (const uint32_t v : originalIndices)
            renumbered[v] = 0;
        for (uint32_t v = 0; v < vertexCount; ++v) {
            if (renumbered[v] == kUnused)
                continue;
            renumbered[v] = static_cast<uint32_t>(original.size());
            original.push_back(v);
        }
        for (const uint32_t v : originalIndices)
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
                                          "use a smaller \"nlevels\"", where);
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

    // Sets tags only: the subdivision masks below are our own.
    Sdc::Options rules;
    rules.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    std::unique_ptr<Far::TopologyRefiner> refiner(
        Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_LOOP, rules)));
    if (!refiner)
        throw Error(where, "OpenSubdiv cannot create a subdivision surface from this mesh");
    Far::TopologyRefiner::UniformOptions options(levels);
    options.fullTopologyInLastLevel = true; // limit masks need the neighbors
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

/// Replaces zero and non-finite normals, which occur at folded or collapsed neighborhoods, by the
/// area-weighted sum of the normals of adjacent triangles, so that a normal is zero only if those of the
/// triangles are.
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

// OpenSubdiv provides the topology; the masks are those of pbrt: Warren's weights at irregular vertices
// (OpenSubdiv uses Loop's), 1/5 for the limit of a boundary, and tangents from the limit points (see
// subdivideKey). Half of the vertices of the Killeroo are irregular. On it, OpenSubdiv's normals differ from
// those of pbrt by 3 degrees (RMS) at one level, which would be visible in the image.

/// Returns the weight of each of n neighbors in refinement (Warren 1995, as in Pharr et al., "Physically
/// Based Rendering").
float refinementWeight(size_t n) { return n == 3 ? 3.f / 16 : 3.f / (8 * static_cast<float>(n)); }
constexpr float kBoundaryRefinementWeight = 1.f / 8;

/// Returns the weight of each of n neighbors for the limit position.
float limitWeight(size_t n) { return 1 / (static_cast<float>(n) + 3 / (8 * refinementWeight(n))); }
constexpr float kBoundaryLimitWeight = 1.f / 5;

/// The one-ring of a vertex, counter-clockwise; at a boundary, from the first boundary neighbor to the last.
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
    /// Returns the weighted sum of the center and its neighbors; the center itself if it is not manifold.
    V3f weightedSum(const V3f& center, float innerWeight, float boundaryWeight) const {
        if (kind == Kind::NonManifold)
            return center;
        if (kind == Kind::Boundary)
            return center * (1 - 2 * boundaryWeight) + (points.front() + points.back()) * boundaryWeight;
        V3f sum(0);
        for (const V3f& p : points)
            sum += p;
        return center * (1 - static_cast<float>(points.size()) * innerWeight) + sum * innerWeight;
    }
    /// Returns the cross product of two tangents; zero if the vertex is not manifold.
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
            s += (points[i] - center) * std::cos(angle); // relative to the center, against cancellation
            t += (points[i] - center) * std::sin(angle);
        }
        return cross(s, t);
    }
    /// Returns the tangent across a boundary, into the surface.
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

/// Returns the new vertex of an edge: 3/8 of each end and 1/8 of each of the two opposite vertices; the
/// midpoint for boundary and non-manifold edges.
V3f splitEdge(const Far::TopologyLevel& level, int edge, const std::vector<V3f>& points) {
    const auto ends = level.GetEdgeVertices(edge);
    const V3f sum = points[ends[0]] + points[ends[1]];
    const auto faces = level.GetEdgeFaces(edge);
    if (faces.size() != 2 || level.IsEdgeNonManifold(edge))
        return sum * 0.5f;
    V3f opposite(0);
    for (const int face : {faces[0], faces[1]}) {
        const auto corners = level.GetFaceVertices(face);
        for (const int v : {corners[0], corners[1], corners[2]}) {
            if (v != ends[0] && v != ends[1])
                opposite += points[v];
        }
    }
    return sum * (3.f / 8) + opposite * (1.f / 8);
}

std::vector<V3f> refineOnce(const Far::TopologyLevel& level, size_t finerCount,
                            const std::vector<V3f>& points) {
    std::vector<V3f> finer(finerCount);
    Ring ring;
    for (int v = 0; v < level.GetNumVertices(); ++v) {
        ring.gather(level, v, points);
        finer[level.GetVertexChildVertex(v)] =
            ring.weightedSum(points[v], refinementWeight(ring.points.size()), kBoundaryRefinementWeight);
    }
    for (int e = 0; e < level.GetNumEdges(); ++e)
        finer[level.GetEdgeChildVertex(e)] = splitEdge(level, e, points);
    return finer;
}

/// Appends the limit positions and normals of one key to `mesh`.
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
        limit[v] = ring.weightedSum(points[v], limitWeight(ring.points.size()), kBoundaryLimitWeight);
    }
    // As in pbrt, the tangent masks are applied to the limit points, although they are derived for the points
    // before.
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
