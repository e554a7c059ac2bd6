#include "sharing/cell_pyramid.h"

#include "core/util/parallel.h"

#include <algorithm>

namespace strobe {

namespace {

float edgeOf(const CellId& id) { return std::ldexp(1.f, id.level); }

/// A point relative to a node: the features of a fit and the weight of the point.
struct FitFrame {
    V3f p, n;
    V3f ps, pt, ns, nt; ///< the tangents, scaled to the derivatives of LightFit
    float inverseRadius2;

    FitFrame(const CellNode& node, float radius) : p(node.p), n(node.n) {
        const Frame frame = Frame::fromNormal(node.n);
        const float inverseRadius = 1 / radius;
        ps = frame.s * inverseRadius;
        pt = frame.t * inverseRadius;
        ns = frame.s * 2.f;
        nt = frame.t * 2.f;
        inverseRadius2 = sqr(inverseRadius);
    }
    void features(const V3f& point, const V3f& normal, float* out) const {
        const V3f dp = point - p, dn = normal - n;
        out[0] = 1;
        out[1] = dot(dp, ps);
        out[2] = dot(dp, pt);
        out[3] = dot(dn, ns);
        out[4] = dot(dn, nt);
    }
    /// Returns a bell of the distance; 0 from √2 radii on.
    float kernel(const V3f& point) const {
        const float u = std::max(1 - length2(point - p) * inverseRadius2 / 2, 0.f);
        return u * u * u;
    }
};

/// The normal equations of weighted least-squares fits of several channels with equal weights.
struct NormalEquations {
    static constexpr int kTerms = LightFit::kTerms, kChannels = LightFit::kChannels;
    static constexpr int kColumns = 24; ///< features, then channels, then zeros
    static constexpr int kPadding = kColumns - kTerms - kChannels;

    alignas(64) float rows[kTerms][kColumns] = {};

    bool hasPoints() const { return rows[0][0] > 0; }

    /// Adds a point whose row holds its features and its values.
    STROBE_FORCE_INLINE void add(const float* row, float weight) {
        for (int a = 0; a < kTerms; ++a) {
            const float wa = weight * row[a];
            for (int c = 0; c < kColumns; ++c)
                rows[a][c] += wa * row[c];
        }
    }
    /// Solves the equations by Cholesky decomposition. The ridge keeps derivatives small that the points do
    /// not determine; it is relative to the total weight.
    LightFit solve() {
        constexpr float kRidge[kTerms] = {0, 0.02f, 0.02f, 0.05f, 0.05f};
        const float total = rows[0][0];
        LightFit fit{};
        if (!(total > 0))
            return fit;
        float inverse[kTerms]; // of the diagonal
        for (int a = 0; a < kTerms; ++a) {
            rows[a][a] += kRidge[a] * total;
            for (int b = 0; b <= a; ++b) {
                float sum = rows[a][b];
                for (int k = 0; k < b; ++k)
                    sum -= rows[a][k] * rows[b][k];
                rows[a][b] = sum * (a == b ? 1 : inverse[b]);
            }
            inverse[a] = 1 / std::sqrt(std::max(rows[a][a], 1e-12f * total));
            rows[a][a] *= inverse[a];
        }
        for (int c = 0; c < kChannels; ++c)
            substitute(inverse, c, fit);
        return fit;
    }

  private:
    void substitute(const float* inverse, int c, LightFit& fit) const {
        float x[kTerms];
        for (int a = 0; a < kTerms; ++a) {
            x[a] = rows[a][kTerms + c];
            for (int k = 0; k < a; ++k)
                x[a] -= x[k] * rows[a][k];
            x[a] *= inverse[a];
        }
        for (int a = kTerms - 1; a >= 0; --a) {
            for (int k = a + 1; k < kTerms; ++k)
                x[a] -= x[k] * rows[k][a];
            x[a] *= inverse[a];
            fit.terms[a][c] = x[a];
        }
    }
};

/// The points of a fit, by point.
struct FitPoints {
    static constexpr int kMax = 256;
    alignas(64) float rows[kMax][NormalEquations::kColumns];
    float weights[kMax];
    int count = 0;
};

STROBE_TARGET_CLONES void accumulate(const FitPoints& points, NormalEquations& out) {
    for (int i = 0; i < points.count; ++i)
        out.add(points.rows[i], points.weights[i]);
}

template <class Work>
void forAll(size_t count, const Work& work) {
    constexpr size_t kRun = 256;
    parallelFor((count + kRun - 1) / kRun, [&](size_t run) {
        for (size_t i = run * kRun; i < std::min((run + 1) * kRun, count); ++i)
            work(i);
    });
}

} // namespace

CellPyramid::CellPyramid(std::span<const CellSums> cells) {
    for (const CellSums& sums : cells)
        addWithAncestors(sums);
    linkCubes();
    finishMeans();
    std::vector<LightFit> fits(m_nodes.size());
    forAll(m_nodes.size(), [&](size_t i) {
        if (m_nodes[i].isFitted)
            fits[i] = fitNode(m_nodes[i]);
    });
    m_estimates.resize(m_recorded.size());
    forAll(m_recorded.size(), [&](size_t i) { m_estimates[i] = estimate(m_recorded[i], fits); });
}

/// Adds the sums of a recorded cell to its node and to those of the larger cells that contain it.
/// Precondition: the cell has samples.
void CellPyramid::addWithAncestors(const CellSums& sums) {
    CellNode own;
    for (int half = 0; half < kHalves; ++half)
        own.count[half] = float(sums.count[half]);
    float* light = own.light;
    for (const auto& part : sums.light)
        for (int half = 0; half < kHalves; ++half) {
            const Rgb sum = part[half].value();
            for (int c = 0; c < 3; ++c)
                *light++ = sum[c];
        }
    const double edge = std::ldexp(1.0, sums.id.level);
    const double positionUnit = 1.0 / (1 << CellSums::kPositionBits);
    const double total = double(own.count[0]) + double(own.count[1]);
    own.p = V3f(float((sums.id.x * total + double(sums.p[0]) * positionUnit) * edge),
                float((sums.id.y * total + double(sums.p[1]) * positionUnit) * edge),
                float((sums.id.z * total + double(sums.p[2]) * positionUnit) * edge));
    own.n =
        V3f(float(sums.n[0]), float(sums.n[1]), float(sums.n[2])) * (1.f / float(1 << CellSums::kNormalBits));
    uint32_t cube = findOrAddCube(sums.id), child = kAbsent;
    for (int scale = 0; scale <= kFitScales; ++scale, cube = parentOf(cube)) {
        const uint32_t index = findOrAddNode(cube, sums.id.face);
        CellNode& node = m_nodes[index];
        node.p += own.p;
        node.n += own.n;
        for (int half = 0; half < kHalves; ++half)
            node.count[half] += own.count[half];
        for (int c = 0; c < LightFit::kChannels; ++c)
            node.light[c] += own.light[c];
        node.isFitted |= scale >= 1;
        if (child == kAbsent)
            m_recorded.push_back(index);
        else
            m_nodes[child].parent = index;
        child = index;
    }
    for (int i = 0; i < kGenerations; ++i)
        cube = parentOf(cube);
}

uint32_t CellPyramid::findOrAddNode(uint32_t cube, int face) {
    uint32_t& index = m_cubes[cube].nodes[face];
    if (index == kAbsent) {
        index = uint32_t(m_nodes.size());
        m_nodes.emplace_back().cube = cube;
    }
    return index;
}

uint32_t CellPyramid::findOrAddCube(CellId id) {
    id.face = 0;
    const uint32_t index = m_cubeIndices.findOrInsert(id.hash(), uint32_t(m_cubes.size()));
    if (index == m_cubes.size()) {
        Cube& cube = m_cubes.emplace_back();
        cube.id = id;
        std::fill(cube.nodes, cube.nodes + kFaces, kAbsent);
        std::fill(cube.children, cube.children + 8, kAbsent);
    }
    return index;
}

uint32_t CellPyramid::parentOf(uint32_t cube) {
    if (m_cubes[cube].parent == kAbsent) {
        const uint32_t parent = findOrAddCube(m_cubes[cube].id.parent());
        m_cubes[cube].parent = parent;
    }
    return m_cubes[cube].parent;
}

/// Sets the links between parents and children. Also those of cubes that are the largest above one recorded
/// cell, but not above another.
void CellPyramid::linkCubes() {
    for (uint32_t i = 0; i < m_cubes.size(); ++i) {
        Cube& cube = m_cubes[i];
        if (cube.parent == kAbsent)
            cube.parent = m_cubeIndices.find(cube.id.parent().hash());
        if (cube.parent != kAbsent)
            m_cubes[cube.parent].children[(cube.id.x & 1) | (cube.id.y & 1) << 1 | (cube.id.z & 1) << 2] = i;
    }
}

void CellPyramid::finishMeans() {
    for (CellNode& node : m_nodes) {
        node.p *= 1 / (node.count[0] + node.count[1]);
        node.n = normalizeAny(node.n);
        for (int c = 0; c < LightFit::kChannels; ++c)
            if (const float count = node.count[c / 3 % kHalves]; count > 0)
                node.light[c] *= 1 / count;
    }
}

/// Calls work(node) for the nodes within two cells of the center in a cube `generations` below `cube`.
template <class Work>
void CellPyramid::forDescendants(const Cube& cube, const CellId& center, int generations,
                                 const Work& work) const {
    const int size = 1 << generations;
    const auto isNear = [&](int32_t low, int32_t c) {
        const int64_t first = int64_t(low) * size;
        return first <= int64_t(c) + kReach && first + size > int64_t(c) - kReach;
    };
    if (!isNear(cube.id.x, center.x) || !isNear(cube.id.y, center.y) || !isNear(cube.id.z, center.z))
        return;
    if (generations == 0) {
        for (const uint32_t node : cube.nodes)
            if (node != kAbsent)
                work(m_nodes[node]);
        return;
    }
    for (const uint32_t child : cube.children)
        if (child != kAbsent)
            forDescendants(m_cubes[child], center, generations - 1, work);
}

/// Calls work(node) for all nodes of the same surface and size within two cells.
template <class Work>
void CellPyramid::forNeighbors(const CellId& id, const Work& work) const {
    static_assert(2 * kReach + 1 <= (1 << kGenerations) + 1, "at most two ancestors in each direction");
    CellId ancestor = id;
    ancestor.face = 0;
    ancestor.level = int16_t(id.level + kGenerations);
    const auto index = [](int64_t coordinate) { return int32_t(coordinate >> kGenerations); };
    for (int32_t x = index(int64_t(id.x) - kReach); x <= index(int64_t(id.x) + kReach); ++x)
        for (int32_t y = index(int64_t(id.y) - kReach); y <= index(int64_t(id.y) + kReach); ++y)
            for (int32_t z = index(int64_t(id.z) - kReach); z <= index(int64_t(id.z) + kReach); ++z) {
                ancestor.x = x;
                ancestor.y = y;
                ancestor.z = z;
                if (const uint32_t cube = m_cubeIndices.find(ancestor.hash()); cube != kAbsent)
                    forDescendants(m_cubes[cube], id, kGenerations, work);
            }
}

/// Fits both halves with the same weights: the inverse variances of the difference between both.
LightFit CellPyramid::fitNode(const CellNode& node) const {
    constexpr float kMinCosine = 0.7f; // between the normals of points that share
    const CellId& id = m_cubes[node.cube].id;
    const FitFrame frame(node, kFitRadius * edgeOf(id));
    FitPoints points;
    NormalEquations equations;
    forNeighbors(id, [&](const CellNode& other) {
        const float weight =
            frame.kernel(other.p) * (other.count[0] * other.count[1] / (other.count[0] + other.count[1]));
        if (!(weight > 0) || dot(node.n, other.n) < kMinCosine)
            return;
        if (points.count == FitPoints::kMax) {
            accumulate(points, equations);
            points.count = 0;
        }
        points.weights[points.count] = weight;
        float* row = points.rows[points.count++];
        frame.features(other.p, other.n, row);
        row += LightFit::kTerms;
        row = std::copy(std::begin(other.light), std::end(other.light), row);
        std::fill(row, row + NormalEquations::kPadding, 0.f);
    });
    accumulate(points, equations);
    LightFit fit = equations.solve();
    if (!equations.hasPoints())
        std::copy(std::begin(node.light), std::end(node.light), fit.terms[0]);
    return fit;
}

CellPyramid::Estimates CellPyramid::estimate(uint32_t index, const std::vector<LightFit>& fits) const {
    Estimates out;
    const CellNode& cell = m_nodes[index];
    std::copy(std::begin(cell.light), std::end(cell.light), out.light[0]);
    uint32_t ancestor = m_nodes[index].parent;
    for (int scale = 0; scale < kFitScales; ++scale) {
        const CellNode& node = m_nodes[ancestor];
        float features[LightFit::kTerms];
        FitFrame(node, kFitRadius * edgeOf(m_cubes[node.cube].id)).features(cell.p, cell.n, features);
        float(&value)[LightFit::kChannels] = out.light[1 + scale];
        std::fill(std::begin(value), std::end(value), 0.f);
        for (int k = 0; k < LightFit::kTerms; ++k)
            for (int c = 0; c < LightFit::kChannels; ++c)
                value[c] += fits[ancestor].terms[k][c] * features[k];
        ancestor = node.parent;
    }
    return out;
}

} // namespace strobe
