#include "loader/compat/pbrt_patches.h"

#include "shapes/mesh_params.h"

namespace strobe {
namespace {

using namespace mesh_params;

const ParamDef<std::vector<V2f>> kUv{"uv", {}, "two texture coordinates per vertex", "st"};

/// Segments along each side of a patch that two triangles do not represent: their distance from the patch is
/// 1/64 of that of two triangles.
constexpr int kSegments = 8;

/// A corner of a patch. The normal is zero unless the mesh has normals.
struct Corner {
    V3f p, n{0};
    V2f uv;
};

template <class T>
T bilinear(const T& a, const T& b, const T& c, const T& d, float u, float v) {
    return (a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v;
}

/// A patch with corners at (u, v) = (0,0), (1,0), (0,1) and (1,1).
struct Patch {
    Corner corners[4];

    /// Returns the unit normal ∂p/∂u × ∂p/∂v; zero where it does not exist.
    V3f normal(float u, float v) const {
        const auto& [a, b, c, d] = corners;
        const V3f n = cross((b.p - a.p) * (1 - v) + (d.p - c.p) * v, (c.p - a.p) * (1 - u) + (d.p - b.p) * u);
        return length2(n) > 0 ? normalize(n) : V3f(0);
    }
    Corner at(float u, float v) const {
        const auto& [a, b, c, d] = corners;
        return {bilinear(a.p, b.p, c.p, d.p, u, v), bilinear(a.n, b.n, c.n, d.n, u, v),
                bilinear(a.uv, b.uv, c.uv, d.uv, u, v)};
    }
    /// Whether positions and texture coordinates are affine functions of (u, v), which triangles represent.
    bool isAffine() const {
        const auto& [a, b, c, d] = corners;
        const V3f twist = a.p + d.p - b.p - c.p;
        const V2f uvTwist = a.uv + d.uv - b.uv - c.uv;
        const float size2 = std::max(length2(d.p - a.p), length2(c.p - b.p));
        return length2(twist) <= 1e-8f * size2 && std::max(std::abs(uvTwist.x), std::abs(uvTwist.y)) <= 1e-5f;
    }
};

void append(TriangleMesh& mesh, const Corner& corner, bool hasNormals) {
    mesh.positions[0].push_back(corner.p);
    mesh.uvs.push_back(corner.uv);
    if (hasNormals)
        mesh.normals[0].push_back(corner.n);
}

/// Appends a patch as a grid of triangles.
void append(TriangleMesh& mesh, const Patch& patch, bool hasNormals, bool computesNormals) {
    const int segments = patch.isAffine() ? 1 : kSegments;
    const auto first = uint32_t(mesh.positions[0].size());
    for (int j = 0; j <= segments; ++j)
        for (int i = 0; i <= segments; ++i) {
            const float u = float(i) / float(segments), v = float(j) / float(segments);
            Corner corner = patch.at(u, v);
            if (computesNormals)
                corner.n = patch.normal(u, v);
            append(mesh, corner, hasNormals);
        }
    const auto columns = uint32_t(segments + 1);
    for (uint32_t j = 0; j + 1 < columns; ++j)
        for (uint32_t i = 0; i + 1 < columns; ++i) {
            const uint32_t a = first + j * columns + i, c = a + columns;
            mesh.indices.insert(mesh.indices.end(), {a, a + 1, c + 1, a, c + 1, c});
        }
}

Shape createBilinearMesh(const ParamSet& params, const BuildContext& context) {
    const KeyedPoints points = readPositions(params);
    const KeyedPoints normals = readNormals(params, points, context);
    const std::vector<V2f> uvs = params.get(kUv);
    std::vector<int> indices = params.get(kIndices);
    if (!params.has(kIndices) && points[0].size() == 4)
        indices = {0, 1, 2, 3};
    if (indices.empty() || indices.size() % 4 != 0)
        throw Error(params.whereIs(kIndices), "\"indices\" needs a multiple of 4 numbers");
    std::vector<Patch> patches(indices.size() / 4);
    for (size_t k = 0; k < indices.size(); ++k) {
        const int index = indices[k];
        if (index < 0 || size_t(index) >= points[0].size() || (!uvs.empty() && size_t(index) >= uvs.size()))
            throw Error(params.whereIs(kIndices), "index " + std::to_string(index) + " is out of range");
        patches[k / 4].corners[k % 4] = {
            points[0][size_t(index)], normals.empty() ? V3f(0) : normals[0][size_t(index)],
            uvs.empty() ? V2f(float(k % 2), float(k / 2 % 2)) : uvs[size_t(index)]};
    }
    const bool computesNormals = normals.empty() && !std::all_of(patches.begin(), patches.end(),
                                                                 [](const Patch& p) { return p.isAffine(); });
    const bool hasNormals = computesNormals || !normals.empty();
    auto mesh = std::make_shared<TriangleMesh>();
    mesh->positions.resize(1);
    mesh->normals.resize(hasNormals ? 1 : 0);
    for (const Patch& patch : patches)
        append(*mesh, patch, hasNormals, computesNormals);
    mesh->alpha = readAlpha(params, context);
    return {mesh, nullptr};
}

} // namespace

ShapeRow bilinearMeshRow() {
    return {"bilinearmesh", "", {kP, kN, kUv, kIndices, kAlpha, kShadowAlpha}, createBilinearMesh};
}

} // namespace strobe
