#include "sharing/cell_pyramid.h"

#include "core/util/parallel.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace strobe {

namespace {

constexpr int kBlock = 4; ///< edge of the blocks of CellPyramid::Neighbors

/// The cells of a block that are near others, by the coordinates of these along each axis, relative to the
/// block.
class NearCells {
  public:
    /// `reach`: the largest distance.
    constexpr explicit NearCells(int reach) : m_reach(reach) {
        for (int axis = 0, stride = 1; axis < 3; ++axis, stride *= kBlock)
            for (int other = 0; other < kCount; ++other)
                for (int cell = 0; cell < kBlock; ++cell)
                    if (std::max(other - reach - cell, cell - other + reach) <= reach)
                        m_bits[axis][other] |= uint64_t(1) << (cell * stride);
    }
    /// Returns bit x + 4 y + 16 z for each near cell.
    uint64_t of(int x, int y, int z) const {
        if (!isNear(x) || !isNear(y) || !isNear(z))
            return 0;
        return m_bits[0][x + m_reach] * m_bits[1][y + m_reach] * m_bits[2][z + m_reach];
    }

  private:
    static constexpr int kCount = 2 * kBlock; ///< coordinates of cells that are near some cell
    bool isNear(int coordinate) const { return coordinate >= -m_reach && coordinate < kCount - m_reach; }
    int m_reach;
    uint64_t m_bits[3][kCount] = {};
};

} // namespace

CellPyramid::CellPyramid(std::span<const JoinedCell> cells, LightParts parts)
    : m_parts(parts), m_cubeIndices(cells.size() + cells.size() / 2) {
    // Most surfaces have a third more nodes than cells, and few cubes have several nodes.
    m_nodes.reserve(cells.size() + cells.size() / 2);
    for (const LightPart part : kAllParts)
        if (parts.has(part))
            m_light[int(part)].reserve(m_nodes.capacity());
    m_cubes.reserve(m_nodes.capacity());
    m_recorded.reserve(cells.size());
    for (const JoinedCell& cell : cells)
        m_recorded.push_back(findOrAddNode(findOrAddCube(cell.id), uint8_t(cell.id.face)));
    int topLevel = std::numeric_limits<int16_t>::min();
    for (const JoinedCell& cell : cells)
        topLevel = std::max(topLevel, cell.id.level + kScales);
    parallelForRuns(cells.size(), [&](size_t i) {
        setSums(*cells[i].sums, m_recorded[i]);
        m_nodes[m_recorded[i]].ancestors = uint8_t(std::min(topLevel - cells[i].id.level, 255));
    });
    addParents();
    linkCubes();
    finishMeans();
}

/// Sets the sums of the node of a recorded cell. Precondition: the cell has samples.
void CellPyramid::setSums(const CellSums& sums, uint32_t index) {
    CellNode& node = m_nodes[index];
    for (int half = 0; half < kHalves; ++half)
        node.count[half] = float(sums.count[half]);
    for (int part = 0; part < kParts; ++part)
        for (int half = 0; half < kHalves && m_parts.has(LightPart(part)); ++half) {
            const Rgb sum = sums.light[part][half].value();
            for (int c = 0; c < 3; ++c)
                m_light[part][index].of[3 * half + c] = sum[c];
        }
    const double edge = std::ldexp(1.0, sums.id.level);
    const double positionUnit = 1.0 / (1 << CellSums::kPositionBits);
    const double total = double(node.count[0]) + double(node.count[1]);
    node.p = V3f(float((sums.id.x * total + double(sums.p[0]) * positionUnit) * edge),
                 float((sums.id.y * total + double(sums.p[1]) * positionUnit) * edge),
                 float((sums.id.z * total + double(sums.p[2]) * positionUnit) * edge));
    node.n =
        V3f(float(sums.n[0]), float(sums.n[1]), float(sums.n[2])) * (1.f / float(1 << CellSums::kNormalBits));
}

/// Adds the nodes above the recorded cells, level by level, each with the sums of its children.
void CellPyramid::addParents() {
    std::map<int, std::vector<uint32_t>> byLevel;
    for (const uint32_t index : m_recorded)
        byLevel[m_cubes[m_nodes[index].cube].id.level].push_back(index);
    for (auto level = byLevel.begin(); level != byLevel.end(); ++level)
        for (const uint32_t index : level->second) {
            uint32_t cube = parentOf(m_nodes[index].cube);
            if (m_nodes[index].ancestors == 0) { // but Neighbors needs cubes
                for (int i = 1; i < kGenerations; ++i)
                    cube = parentOf(cube);
                continue;
            }
            const size_t before = m_nodes.size();
            const uint32_t parent = findOrAddNode(cube, m_nodes[index].face);
            if (m_nodes.size() > before)
                byLevel[level->first + 1].push_back(parent);
            m_nodes[index].parent = parent;
            addChild(index, parent);
        }
}

/// Adds the sums of a node to those of its parent.
void CellPyramid::addChild(uint32_t child, uint32_t parent) {
    const CellNode& from = m_nodes[child];
    CellNode& to = m_nodes[parent];
    to.p += from.p;
    to.n += from.n;
    for (int half = 0; half < kHalves; ++half)
        to.count[half] += from.count[half];
    to.ancestors = std::max(to.ancestors, uint8_t(from.ancestors - 1));
    for (auto& ofPart : m_light)
        for (int c = 0; c < NodeLight::kChannels && !ofPart.empty(); ++c)
            ofPart[parent].of[c] += ofPart[child].of[c];
}

void CellPyramid::addLight(size_t cell, LightPart part, int half, const Rgb& light) {
    forEachAncestor(m_recorded[cell], [&](uint32_t index) {
        for (int c = 0; c < 3; ++c)
            m_light[int(part)][index].of[3 * half + c] += light[c] / m_nodes[index].count[half];
    });
}

std::vector<uint32_t> CellPyramid::cellsByNode() const {
    // The children of each node, linked, and the roots.
    std::vector<uint32_t> firstChild(m_nodes.size(), kAbsent), nextSibling(m_nodes.size(), kAbsent), stack;
    for (uint32_t i = 0; i < m_nodes.size(); ++i)
        if (m_nodes[i].ancestors > 0)
            nextSibling[i] = std::exchange(firstChild[m_nodes[i].parent], i);
        else
            stack.push_back(i);
    std::vector<uint32_t> cellOf(m_nodes.size(), kAbsent), out;
    for (uint32_t cell = 0; cell < m_recorded.size(); ++cell)
        cellOf[m_recorded[cell]] = cell;
    out.reserve(m_recorded.size());
    while (!stack.empty()) {
        const uint32_t node = stack.back();
        stack.pop_back();
        if (cellOf[node] != kAbsent)
            out.push_back(cellOf[node]);
        for (uint32_t child = firstChild[node]; child != kAbsent; child = nextSibling[child])
            stack.push_back(child);
    }
    return out;
}

uint32_t CellPyramid::findOrAddNode(uint32_t cube, uint8_t face) {
    uint32_t& index = m_cubes[cube].nodes[face];
    if (index == kAbsent) {
        index = uint32_t(m_nodes.size());
        CellNode& node = m_nodes.emplace_back();
        node.cube = cube;
        node.face = face;
        for (const LightPart part : kAllParts)
            if (m_parts.has(part))
                m_light[int(part)].emplace_back();
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
    parallelForRuns(m_nodes.size(), [&](size_t i) {
        CellNode& node = m_nodes[i];
        node.p *= 1 / (node.count[0] + node.count[1]);
        node.n = normalizeAny(node.n);
        for (auto& ofPart : m_light)
            for (int c = 0; c < NodeLight::kChannels && !ofPart.empty(); ++c)
                if (const float count = node.count[c / 3]; count > 0)
                    ofPart[i].of[c] *= 1 / count;
    });
}

std::span<const uint32_t> CellPyramid::Neighbors::of(uint32_t node) {
    const CellId& id = m_pyramid.m_cubes[m_pyramid.m_nodes[node].cube].id;
    const CellId block = id.parent().parent();
    static_assert(kBlock == 1 << kGenerations);
    if (block != m_block || m_visited.none()) {
        m_block = block;
        m_visited.reset();
        m_candidates.clear();
    }
    const int x = id.x - kBlock * block.x, y = id.y - kBlock * block.y, z = id.z - kBlock * block.z;
    visitCubesAround(x, y, z);
    m_found.resize(std::max(m_found.size(), m_candidates.size()));
    const int bit = x + kBlock * (y + kBlock * z);
    size_t count = 0;
    for (const Candidate& candidate : m_candidates) {
        m_found[count] = candidate.node;
        count += candidate.cells >> bit & 1;
    }
    return {m_found.data(), count};
}

/// Adds the nodes of the cubes, each as large as the block, that are near a cell of the block: of up to two
/// cubes along each axis.
void CellPyramid::Neighbors::visitCubesAround(int x, int y, int z) {
    const auto first = [](int cell) { return cell < kReach ? -1 : 0; };
    for (int dx = first(x); dx <= first(x) + 1; ++dx)
        for (int dy = first(y); dy <= first(y) + 1; ++dy)
            for (int dz = first(z); dz <= first(z) + 1; ++dz) {
                const size_t number = size_t(dx + 1 + 3 * (dy + 1) + 9 * (dz + 1));
                if (m_visited[number])
                    continue;
                m_visited.set(number);
                CellId id = m_block;
                id.x += dx;
                id.y += dy;
                id.z += dz;
                if (const uint32_t cube = m_pyramid.m_cubeIndices.find(id.hash()); cube != kAbsent)
                    addDescendants(m_pyramid.m_cubes[cube]);
            }
}

/// Adds the nodes near any cell of the block in a cube as large as the block.
void CellPyramid::Neighbors::addDescendants(const Cube& cube) {
    static_assert(kReach == kBlock / 2, "children contain near cells only, or none");
    static constexpr NearCells kNear(kReach);
    const auto isNear = [](int32_t child, int32_t block) {
        return child - 2 * block >= -1 && child - 2 * block <= 2;
    };
    for (const uint32_t childIndex : cube.children) {
        if (childIndex == kAbsent)
            continue;
        const Cube& child = m_pyramid.m_cubes[childIndex];
        if (!isNear(child.id.x, m_block.x) || !isNear(child.id.y, m_block.y) ||
            !isNear(child.id.z, m_block.z))
            continue;
        for (const uint32_t leafIndex : child.children) {
            if (leafIndex == kAbsent)
                continue;
            const Cube& leaf = m_pyramid.m_cubes[leafIndex];
            const uint64_t cells = kNear.of(leaf.id.x - kBlock * m_block.x, leaf.id.y - kBlock * m_block.y,
                                            leaf.id.z - kBlock * m_block.z);
            for (const uint32_t node : leaf.nodes)
                if (node != kAbsent && cells != 0)
                    m_candidates.push_back({cells, node});
        }
    }
}

} // namespace strobe
