#include "loader/compat/pbrt_compat.h"

#include "loader/compat/pbrt_patches.h"
#include "shapes/mesh_params.h"

#include <numeric>

namespace strobe {
namespace {

using namespace mesh_params;

/// A mesh of a grid of vertices, added row by row.
struct GridMesh {
    int columns, rows; ///< of vertices
    std::shared_ptr<TriangleMesh> mesh = std::make_shared<TriangleMesh>();

    GridMesh(int columns, int rows) : columns(columns), rows(rows) {
        mesh->positions.resize(1);
        mesh->normals.resize(1);
    }
    void addVertex(const V3f& p, const V3f& n, const V2f& uv) {
        mesh->positions[0].push_back(p);
        mesh->normals[0].push_back(n);
        mesh->uvs.push_back(uv);
    }
    Shape finish(const ParamSet& params, const BuildContext& context) {
        for (int j = 0; j + 1 < rows; ++j)
            for (int i = 0; i + 1 < columns; ++i) {
                const auto vertex = uint32_t(j * columns + i);
                const uint32_t above = vertex + uint32_t(columns);
                mesh->indices.insert(mesh->indices.end(),
                                     {vertex, vertex + 1, above + 1, vertex, above + 1, above});
            }
        mesh->alpha = readAlpha(params, context);
        return {mesh, nullptr};
    }
};

const ParamDef<float> kRadius{"radius", 1, "radius"};
const ParamDef<float> kZMin{"zmin", -1, "lowest z"}, kZMax{"zmax", 1, "highest z"};
const ParamDef<float> kHeight{"height", 1, "height"};
const ParamDef<float> kPhiMax{"phimax", 360, "sweep about z in degrees"};
const ParamDef<V3f> kP1{"p1", V3f(0), "start of the line that is revolved"},
    kP2{"p2", V3f(1), "end of the line"};

/// Returns the surface of revolution about z of a profile curve: profile(v), v from 0 to 1, is the radius and
/// the height. `steps`: number of segments along the profile. `start`: angle about z at which the sweep
/// starts, by v.
Shape revolve(
    const ParamSet& params, const BuildContext& context, const std::function<V2f(float)>& profile, int steps,
    const std::function<float(float)>& start = [](float) { return 0.f; }) {
    constexpr int kAround = 96;    // deviates from the circle by less than 1/1000 of the radius
    constexpr float kStep = 1e-3f; // of the derivative of the profile
    const float sweep = radians(std::clamp(params.get(kPhiMax), 0.f, 360.f));
    GridMesh grid(kAround + 1, steps + 1);
    for (int j = 0; j <= steps; ++j) {
        const float v = float(j) / float(steps);
        const float before = std::max(v - kStep, 0.f);
        const float after = std::min(v + kStep, 1.f);
        const V2f p = profile(v);
        const V2f derivative = (profile(after) - profile(before)) / (after - before);
        for (int i = 0; i <= kAround; ++i) {
            const float u = float(i) / kAround;
            const float c = std::cos(start(v) + u * sweep);
            const float s = std::sin(start(v) + u * sweep);
            grid.addVertex({p.x * c, p.x * s, p.y}, {derivative.y * c, derivative.y * s, -derivative.x},
                           {u, v});
        }
    }
    return grid.finish(params, context);
}

Shape createCylinder(const ParamSet& params, const BuildContext& context) {
    const float radius = params.get(kRadius);
    const float z0 = params.get(kZMin);
    const float z1 = params.get(kZMax);
    return revolve(
        params, context, [=](float v) { return V2f(radius, lerp(z0, z1, v)); }, 1);
}
/// A sphere with cutouts. zmin and zmax clip it.
Shape createSphere(const ParamSet& params, const BuildContext& context) {
    const float radius = params.get(kRadius);
    const auto angle = [&](const ParamDef<float>& def, float fallback) { // from -z
        const float z = params.has(def) ? std::clamp(params.get(def), -radius, radius) : fallback;
        return std::acos(std::clamp(-z / radius, -1.f, 1.f));
    };
    const float first = angle(kZMin, -radius), last = angle(kZMax, radius);
    const auto profile = [=](float v) {
        const float theta = lerp(first, last, v);
        return V2f(radius * std::sin(theta), -radius * std::cos(theta));
    };
    Shape shape = revolve(params, context, profile, 96);
    shape.mesh->isSphere = true;
    return shape;
}
const ParamDef<float> kDiskHeight{"height", 0, "z of the disk"};
const ParamDef<float> kInnerRadius{"innerradius", 0, "radius of the hole"};

/// A disk with cutouts. v is 0 at the edge and 1 in the center, as in pbrt.
Shape createDisk(const ParamSet& params, const BuildContext& context) {
    const float radius = params.get(kRadius);
    const float height = params.get(kDiskHeight);
    const float inner = params.get(kInnerRadius);
    return revolve(
        params, context, [=](float v) { return V2f(lerp(radius, inner, v), height); }, 16);
}
Shape createCone(const ParamSet& params, const BuildContext& context) {
    const float radius = params.get(kRadius);
    const float height = params.get(kHeight);
    return revolve(
        params, context, [=](float v) { return V2f(radius * (1 - v), height * v); }, 16);
}
Shape createParaboloid(const ParamSet& params, const BuildContext& context) {
    const float radius = params.get(kRadius);
    const float z1 = params.get(kZMax);
    const float z0 = params.has(kZMin) ? params.get(kZMin) : 0;
    const auto profile = [=](float v) {
        const float z = lerp(z0, z1, v);
        return V2f(radius * std::sqrt(std::max(z / z1, 0.f)), z);
    };
    return revolve(params, context, profile, 48);
}
/// ah x² + ah y² - ch z² = 1 through p1 and p2, as pbrt computes it.
struct Hyperboloid {
    float ah, ch;
};

/// pbrt moves p1 along the line until the equation has a solution, so that the surface is not the one that
/// the line sweeps out. If the line is level, no solution exists; the surface is then that of the line.
std::optional<Hyperboloid> solveHyperboloid(const V3f& p1, const V3f& p2) {
    const float xy2 = p2.x * p2.x + p2.y * p2.y;
    V3f p = p1;
    for (int i = 0; i < 64; ++i) {
        p += 2.f * (p2 - p1);
        const float xy1 = p.x * p.x + p.y * p.y;
        const float slope = p.z * p.z / (xy1 * p2.z * p2.z);
        const float ah = (1 / xy1 - slope) / (1 - xy2 * slope);
        if (std::isfinite(ah) && ah != 0)
            return Hyperboloid{ah, (ah * xy2 - 1) / (p2.z * p2.z)};
    }
    return std::nullopt;
}

Shape createHyperboloid(const ParamSet& params, const BuildContext& context) {
    V3f a = params.get(kP1);
    V3f b = params.get(kP2);
    if (b.z == 0)
        std::swap(a, b);
    const std::optional<Hyperboloid> surface = solveHyperboloid(a, b);
    const auto profile = [=](float v) {
        const V3f p = lerp(a, b, v);
        if (!surface)
            return V2f(std::hypot(p.x, p.y), p.z);
        return V2f(std::sqrt(std::max((1 + surface->ch * p.z * p.z) / surface->ah, 0.f)), p.z);
    };
    const auto start = [=](float v) {
        const V3f p = lerp(a, b, v);
        return std::atan2(p.y, p.x);
    };
    return revolve(params, context, profile, 48, start);
}

const ParamDef<int> kNu{"nu", 0, "number of points along x"}, kNv{"nv", 0, "number of points along y"};
const ParamDef<std::vector<float>> kPz{"Pz", {}, "heights"};

Shape createHeightField(const ParamSet& params, const BuildContext& context) {
    const int nu = params.get(kNu), nv = params.get(kNv);
    const std::vector<float> heights = params.get(kPz);
    if (nu < 2 || nv < 2 || heights.size() / size_t(nu) != size_t(nv) || heights.size() % size_t(nu) != 0)
        throw Error(params.whereIs(kPz), "\"Pz\" needs nu times nv numbers, at least 2 times 2");
    GridMesh grid(nu, nv);
    for (size_t k = 0; k < heights.size(); ++k) {
        const V2f uv(float(int(k) % nu) / float(nu - 1), float(int(k) / nu) / float(nv - 1));
        grid.addVertex({uv.x, uv.y, heights[k]}, V3f(0), uv);
    }
    grid.mesh->normals.clear();
    return grid.finish(params, context);
}

const ParamDef<std::string> kBasis{"basis", "bezier", "bezier or bspline"};
const ParamDef<std::string> kType{"type", "flat", "flat, cylinder or ribbon; all become tubes"};
const ParamDef<int> kDegree{"degree", 3, "2 or 3"};
const ParamDef<float> kWidth{"width", 1, "width"}, kWidth0{"width0", 1, "width at the start; default: width"},
    kWidth1{"width1", 1, "width at the end; default: width"};
const ParamDef<float> kSplitDepth{"splitdepth", 3, "ignored"};
const ParamDef<std::vector<V3f>> kCurveN{"N", {}, "ignored: normals of ribbons"};

/// Returns the point at `t`, from 0 to 1, of the segment with control points `p`: de Casteljau's algorithm,
/// or de Boor's with uniform knots.
V3f curvePoint(std::vector<V3f> p, bool bspline, float t) {
    const int degree = int(p.size()) - 1;
    for (int level = 1; level <= degree; ++level)
        for (int i = 0; i + level <= degree; ++i) {
            const float span = float(degree - level + 1); // knots
            const float x = bspline ? (t + float(degree - level - i)) / span : t;
            p[size_t(i)] = lerp(p[size_t(i)], p[size_t(i) + 1], x);
        }
    return p[0];
}

/// Returns points on the curve: both ends of each segment and five points between them. Throws a located
/// Error if the number of control points does not make whole segments.
std::vector<V3f> curveAxis(const ParamSet& params) {
    constexpr int kSteps = 6;
    const std::vector<V3f> points = params.require(kP);
    const bool bspline = params.get(kBasis) == "bspline";
    const int degree = params.get(kDegree);
    const int stride = bspline ? 1 : degree;
    const int count = int(points.size());
    if ((degree != 2 && degree != 3) || count <= degree || (count - 1 - degree) % stride != 0)
        throw Error(params.whereIs(kP), "the number of points of \"P\" does not make whole curve segments");
    const int segments = (count - 1 - degree) / stride + 1;
    std::vector<V3f> axis;
    for (int s = 0; s < segments; ++s) {
        const std::vector<V3f> p(points.begin() + s * stride, points.begin() + s * stride + degree + 1);
        for (int i = s == 0 ? 0 : 1; i <= kSteps; ++i)
            axis.push_back(curvePoint(p, bspline, float(i) / kSteps));
    }
    return axis;
}

Shape createCurve(const ParamSet& params, const BuildContext& context) {
    constexpr int kSides = 6;
    const std::vector<V3f> axis = curveAxis(params);
    // Ignored parameters are read, so that they are not reported.
    params.get(kType);
    params.get(kSplitDepth);
    params.get(kCurveN);
    const float width = params.get(kWidth);
    const float w0 = params.has(kWidth0) ? params.get(kWidth0) : width;
    const float w1 = params.has(kWidth1) ? params.get(kWidth1) : width;
    GridMesh grid(kSides + 1, int(axis.size()));
    V3f side(0);
    for (size_t j = 0; j < axis.size(); ++j) {
        const V3f along = axis[std::min(j + 1, axis.size() - 1)] - axis[j == 0 ? 0 : j - 1];
        const V3f t = length2(along) > 0 ? normalize(along) : V3f(0, 0, 1);
        side -= t * dot(side, t); // the frame turns as little as possible along the curve
        side = length2(side) > 1e-12f ? normalize(side) : Frame::fromNormal(t).s;
        const float v = float(j) / float(axis.size() - 1);
        const float radius = lerp(w0, w1, v) / 2;
        for (int i = 0; i <= kSides; ++i) {
            const float u = float(i) / kSides;
            const float phi = 2 * kPi * u;
            const V3f n = side * std::cos(phi) + cross(t, side) * std::sin(phi);
            grid.addVertex(axis[j] + n * radius, n, {v, u});
        }
    }
    return grid.finish(params, context);
}

} // namespace

std::vector<CompatPlugin<ShapeRow>> compatShapes() {
    const std::string triangles = kConvertedToTriangles;
    return {
        {{"sphere", "", {kRadius, kZMin, kZMax, kPhiMax, kAlpha, kShadowAlpha}, createSphere}, triangles},
        {{"disk", "", {kDiskHeight, kRadius, kInnerRadius, kPhiMax, kAlpha, kShadowAlpha}, createDisk},
         triangles},
        {{"cylinder", "", {kRadius, kZMin, kZMax, kPhiMax, kAlpha, kShadowAlpha}, createCylinder}, triangles},
        {{"cone", "", {kRadius, kHeight, kPhiMax, kAlpha, kShadowAlpha}, createCone}, triangles},
        {{"paraboloid", "", {kRadius, kZMin, kZMax, kPhiMax, kAlpha, kShadowAlpha}, createParaboloid},
         triangles},
        {{"hyperboloid", "", {kP1, kP2, kPhiMax, kAlpha, kShadowAlpha}, createHyperboloid}, triangles},
        {bilinearMeshRow(), triangles},
        {{"heightfield", "", {kNu, kNv, kPz}, createHeightField}, triangles},
        {{"heightfield2", "", {kNu, kNv, kPz}, createHeightField}, triangles},
        {{"curve",
          "",
          {kP, kBasis, kType, kDegree, kWidth, kWidth0, kWidth1, kSplitDepth, kCurveN, kAlpha, kShadowAlpha},
          createCurve},
         "it is converted to a tube of triangles"},
    };
}

} // namespace strobe
