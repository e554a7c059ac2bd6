#include "sharing/cell_pyramid.h"

#include "core/util/parallel.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace strobe {

namespace {

void addChild(const CellNode& child, CellNode& parent) {
    parent.p += child.p;
    parent.n += child.n;
    for (int half = 0; half < kHalves; ++half)
        parent.count[half] += child.count[half];
    for (int c = 0; c < kLightChannels; ++c)
        parent.light[c] += child.light[c];
    parent.ancestors = std::max(parent.ancestors, uint8_t(child.ancestors - 1));
}

} // namespace

CellPyramid::CellPyramid(std::span<const JoinedCell> cells) : m_cubeIndices(cells.size() + cells.size() / 2) {
    // Most surfaces have a third more nodes than cells, and few cubes have several nodes.
    m_nodes.reserve(cells.size() + cells.size() / 2);
    m_cubes.reserve(m_nodes.capacity());
    m_recorded.reserve(cells.size());
    for (const JoinedCell& cell : cells)
        m_recorded.push_back(findOrAddNode(findOrAddCube(cell.id), uint8_t(cell.id.face)));
    int topLevel = std::numeric_limits<int16_t>::min();
    for (const JoinedCell& cell : cells)
        topLevel = std::max(topLevel, cell.id.level + kScales);
    parallelForRuns(cells.size(), [&](size_t i) {
        CellNode& node = m_nodes[m_recorded[i]];
        setSums(*cells[i].sums, node);
        node.ancestors = uint8_t(std::min(topLevel - cells[i].id.level, 255));
    });
    addParents();
    linkCubes();
    finishMeans();
}

/// Sets the sums of the node of a recorded cell. Precondition: the cell has samples.
void CellPyramid::setSums(const CellSums& sums, CellNode& node) {
    for (int half = 0; half < kHalves; ++half)
        node.count[half] = float(sums.count[half]);
    for (int part = 0; part < kParts; ++part)
        for (int half = 0; half < kHalves; ++half) {
            const Rgb sum = sums.light[part][half].value();
            for (int c = 0; c < 3; ++c)
                node.light[channelOf(part, half) + c] = sum[c];
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
            if (m_nodes[index].ancestors == 0) { // but forNeighbors needs cubes
                for (int i = 1; i < kGenerations; ++i)
                    cube = parentOf(cube);
                continue;
            }
            const size_t before = m_nodes.size();
            const uint32_t parent = findOrAddNode(cube, m_nodes[index].face);
            if (m_nodes.size() > before)
                byLevel[level->first + 1].push_back(parent);
            m_nodes[index].parent = parent;
            addChild(m_nodes[index], m_nodes[parent]);
        }
}

void CellPyramid::addLight(size_t cell, int part, int half, const Rgb& light) {
    forEachAncestor(m_recorded[cell], [&](uint32_t index) {
        for (int c = 0; c < 3; ++c)
            m_nodes[index].light[channelOf(part, half) + c] += light[c] / m_nodes[index].count[half];
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
        for (int c = 0; c < kLightChannels; ++c)
            if (const float count = node.count[c / 3 % kHalves]; count > 0)
                node.light[c] *= 1 / count;
    });
}

} // namespace strobe
