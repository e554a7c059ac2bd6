// The construction of CellPyramid.
#include "core/util/parallel.h"
#include "sharing/cell_pyramid.h"

#include <algorithm>
#include <functional>

namespace strobe {

/// Adds the nodes and the cubes of a CellPyramid. A cell adds those that contain it and that no cell before
/// it has added: the cubes below its common cube with the last cell, and the nodes below that with the last
/// cell of the same face. Their numbers follow from the ids, so that runs of cells are processed in parallel.
/// The few links between the nodes and cubes of different runs are set afterwards.
class CellPyramid::Builder {
  public:
    Builder(std::span<const JoinedCell> cells, CellPyramid& pyramid);
    void build();

  private:
    /// A link to what an earlier run has added: to the node or cube of a level that contains a cell.
    struct Link {
        enum class Kind { NodeToParent, NodeToCube, CubeToParent } kind;
        uint32_t from, cell;
        int level;
    };
    /// Some cells, and what they add.
    struct Run {
        size_t first = 0, end = 0;   ///< cells
        uint32_t lastOfFace[kFaces]; ///< the last cells of earlier runs; kAbsent: none
        uint32_t firstNode = 0, endNode = 0, firstCube = 0, endCube = 0;
        std::vector<Link> links;
    };
    /// The nodes or cubes of a run that contain its last cell, by level; kAbsent: of an earlier run.
    using Path = std::vector<uint32_t>;

    int addedLevels(size_t cell, uint32_t before, int top) const;
    int addedCubes(size_t cell) const;
    int addedNodes(size_t cell, uint32_t before) const { return addedLevels(cell, before, m_topNode); }
    void findLastOfFaces();
    void count(Run& run) const;
    void allocate();
    void add(Run& run);
    void addCubes(Run& run, uint32_t cell, uint32_t& next, Path& path);
    void addNodes(Run& run, uint32_t cell, uint32_t before, uint32_t& next, const Path& cubes, Path& path);
    void setSums(const JoinedCell& cell, uint32_t index);
    void setLinks(const Run& run);
    void open(uint32_t node);
    void linkChildren(const Run& run);
    void addToParent(uint32_t node);
    void addUp(const Run& run);
    int levelOf(const CellNode& node) const { return m_topNode - node.ancestors; }

    const std::span<const JoinedCell> m_cells;
    CellPyramid& m_pyramid;
    int m_bottom, m_topNode, m_topCube; ///< levels of the smallest cells and of the largest nodes and cubes
    std::vector<Run> m_runs;
    /// Nodes whose sums, or those of their parents, several runs add to.
    std::vector<uint32_t> m_open;
    std::vector<bool> m_isOpen;
};

CellPyramid::CellPyramid(std::span<const JoinedCell> cells, LightParts parts) : m_parts(parts) {
    if (cells.empty())
        return;
    Builder(cells, *this).build();
    indexBlocks();
    finishMeans();
}

CellPyramid::Builder::Builder(std::span<const JoinedCell> cells, CellPyramid& pyramid)
    : m_cells(cells), m_pyramid(pyramid) {
    const auto [smallest, largest] = std::minmax_element(
        cells.begin(), cells.end(), [](const auto& a, const auto& b) { return a.id.level < b.id.level; });
    m_bottom = smallest->id.level;
    m_topNode = largest->id.level + kScales;
    m_topCube = m_topNode + kGenerations; // Neighbors needs these
    constexpr size_t kRun = 2048;
    m_runs.resize((cells.size() + kRun - 1) / kRun);
    for (size_t i = 0; i < m_runs.size(); ++i) {
        m_runs[i].first = i * kRun;
        m_runs[i].end = std::min((i + 1) * kRun, cells.size());
    }
}

void CellPyramid::Builder::build() {
    const auto forRuns = [&](const auto& work) {
        parallelFor(m_runs.size(), [&](size_t run) { work(m_runs[run]); });
    };
    findLastOfFaces();
    forRuns([&](Run& run) { count(run); });
    allocate();
    forRuns([&](Run& run) { add(run); });
    for (const Run& run : m_runs)
        setLinks(run);
    forRuns([&](const Run& run) { linkChildren(run); });
    forRuns([&](const Run& run) { addUp(run); });
    std::sort(m_open.begin(), m_open.end(), std::greater());
    for (const uint32_t node : m_open)
        addToParent(node);
}

/// Sets Run::lastOfFace of all runs.
void CellPyramid::Builder::findLastOfFaces() {
    uint32_t last[kFaces];
    std::fill(last, last + kFaces, kAbsent);
    for (Run& run : m_runs) {
        std::copy(last, last + kFaces, run.lastOfFace);
        for (size_t i = run.first; i < run.end; ++i)
            last[m_cells[i].id.face] = uint32_t(i);
    }
}

/// Returns the number of levels up to `top`, from that of the cell on, at which no cube contains both it and
/// the one before. `before`: kAbsent: there is none.
int CellPyramid::Builder::addedLevels(size_t cell, uint32_t before, int top) const {
    const CellId& id = m_cells[cell].id;
    const bool isFirst = before == kAbsent || m_cells[before].id.surface != id.surface;
    return (isFirst ? top + 1 : std::min(commonLevel(m_cells[before].id, id), top + 1)) - id.level;
}

int CellPyramid::Builder::addedCubes(size_t cell) const {
    return addedLevels(cell, cell > 0 ? uint32_t(cell - 1) : kAbsent, m_topCube);
}

/// Sets Run::endNode and endCube to the numbers of nodes and cubes.
void CellPyramid::Builder::count(Run& run) const {
    uint32_t last[kFaces];
    std::copy(run.lastOfFace, run.lastOfFace + kFaces, last);
    for (size_t i = run.first; i < run.end; ++i) {
        uint32_t& before = last[m_cells[i].id.face];
        run.endNode += uint32_t(addedNodes(i, before));
        run.endCube += uint32_t(addedCubes(i));
        before = uint32_t(i);
    }
}

/// Gives each run its nodes and cubes. They are undefined yet.
void CellPyramid::Builder::allocate() {
    uint32_t nodes = 0, cubes = 0;
    for (Run& run : m_runs) {
        run.firstNode = nodes;
        run.firstCube = cubes;
        run.endNode = nodes += run.endNode;
        run.endCube = cubes += run.endCube;
    }
    m_pyramid.m_recorded.resize(m_cells.size());
    m_pyramid.m_nodes.resize(nodes);
    for (const LightPart part : kAllParts)
        if (m_pyramid.m_parts.has(part))
            m_pyramid.m_light[int(part)].resize(nodes);
    m_pyramid.m_cubes.resize(cubes);
    m_isOpen.resize(nodes);
}

/// Adds the nodes and cubes of a run, those of each cell from the largest to the smallest.
void CellPyramid::Builder::add(Run& run) {
    Path cubes(size_t(m_topCube - m_bottom + 1), kAbsent), nodes[kFaces];
    std::fill(nodes, nodes + kFaces, cubes);
    uint32_t last[kFaces];
    std::copy(run.lastOfFace, run.lastOfFace + kFaces, last);
    uint32_t nextNode = run.firstNode, nextCube = run.firstCube;
    for (auto cell = uint32_t(run.first); cell < run.end; ++cell) {
        const size_t face = m_cells[cell].id.face;
        addCubes(run, cell, nextCube, cubes);
        addNodes(run, cell, last[face], nextNode, cubes, nodes[face]);
        last[face] = cell;
    }
}

void CellPyramid::Builder::addCubes(Run& run, uint32_t cell, uint32_t& next, Path& path) {
    const CellId& id = m_cells[cell].id;
    for (int level = id.level + addedCubes(cell) - 1; level >= id.level; --level, ++next) {
        Cube& cube = m_pyramid.m_cubes[next];
        cube.id = id.ancestor(level);
        cube.id.face = 0;
        std::fill(cube.nodes, cube.nodes + kFaces, kAbsent);
        std::fill(cube.children, cube.children + 8, kAbsent);
        cube.parent = level < m_topCube ? path[size_t(level + 1 - m_bottom)] : kAbsent;
        if (level < m_topCube && cube.parent == kAbsent)
            run.links.push_back({Link::Kind::CubeToParent, next, uint32_t(run.first - 1), level + 1});
        path[size_t(level - m_bottom)] = next;
    }
}

/// `before`: the last cell of the same face.
void CellPyramid::Builder::addNodes(Run& run, uint32_t cell, uint32_t before, uint32_t& next,
                                    const Path& cubes, Path& path) {
    const CellId& id = m_cells[cell].id;
    for (int level = id.level + addedNodes(cell, before) - 1; level >= id.level; --level, ++next) {
        CellNode node;
        node.face = uint8_t(id.face);
        node.ancestors = uint8_t(m_topNode - level);
        node.cube = cubes[size_t(level - m_bottom)];
        if (node.cube == kAbsent)
            run.links.push_back({Link::Kind::NodeToCube, next, uint32_t(run.first - 1), level});
        if (level < m_topNode) {
            node.parent = path[size_t(level + 1 - m_bottom)];
            if (node.parent == kAbsent)
                run.links.push_back({Link::Kind::NodeToParent, next, run.lastOfFace[id.face], level + 1});
        }
        path[size_t(level - m_bottom)] = next;
        m_pyramid.m_nodes[next] = node;
        for (auto& ofPart : m_pyramid.m_light)
            if (!ofPart.empty())
                ofPart[next] = {};
    }
    m_pyramid.m_recorded[cell] = next - 1;
    setSums(m_cells[cell], next - 1);
}

/// Sets the sums of the node of a recorded cell. Precondition: the cell has samples.
void CellPyramid::Builder::setSums(const JoinedCell& cell, uint32_t index) {
    CellNode& node = m_pyramid.m_nodes[index];
    node.p = cell.p;
    node.n = cell.n;
    for (int half = 0; half < kHalves; ++half) {
        node.count[half] = cell.count[half];
        for (int part = 0; part < kParts; ++part)
            for (int c = 0; c < 3 && m_pyramid.m_parts.has(LightPart(part)); ++c)
                m_pyramid.m_light[part][index].of[3 * half + c] = cell.light[part][half][c];
    }
}

/// Sets the links of a run to earlier ones, whose links are set.
void CellPyramid::Builder::setLinks(const Run& run) {
    auto& nodes = m_pyramid.m_nodes;
    auto& cubes = m_pyramid.m_cubes;
    for (const Link& link : run.links) {
        uint32_t to = m_pyramid.m_recorded[link.cell];
        if (link.kind == Link::Kind::NodeToParent) {
            while (levelOf(nodes[to]) < link.level)
                to = nodes[to].parent;
            nodes[link.from].parent = to;
            open(link.from);
            continue;
        }
        to = nodes[to].cube;
        while (cubes[to].id.level < link.level)
            to = cubes[to].parent;
        (link.kind == Link::Kind::NodeToCube ? nodes[link.from].cube : cubes[link.from].parent) = to;
    }
}

/// Marks a node and those that contain it as open.
void CellPyramid::Builder::open(uint32_t node) {
    while (!m_isOpen[node]) {
        m_isOpen[node] = true;
        m_open.push_back(node);
        if (m_pyramid.m_nodes[node].ancestors == 0)
            return;
        node = m_pyramid.m_nodes[node].parent;
    }
}

/// Links cubes to the nodes and cubes of a run.
void CellPyramid::Builder::linkChildren(const Run& run) {
    auto& cubes = m_pyramid.m_cubes;
    for (uint32_t i = run.firstNode; i < run.endNode; ++i)
        cubes[m_pyramid.m_nodes[i].cube].nodes[m_pyramid.m_nodes[i].face] = i;
    for (uint32_t i = run.firstCube; i < run.endCube; ++i)
        if (const CellId& id = cubes[i].id; cubes[i].parent != kAbsent)
            cubes[cubes[i].parent].children[(id.x & 1) | (id.y & 1) << 1 | (id.z & 1) << 2] = i;
}

/// Adds up the sums of the nodes of a run, except those of open nodes.
void CellPyramid::Builder::addUp(const Run& run) {
    for (uint32_t i = run.endNode; i-- > run.firstNode;)
        if (!m_isOpen[i])
            addToParent(i);
}

/// Adds the sums of a node to those of its parent.
void CellPyramid::Builder::addToParent(uint32_t node) {
    const CellNode& from = m_pyramid.m_nodes[node];
    if (from.ancestors == 0)
        return;
    CellNode& to = m_pyramid.m_nodes[from.parent];
    to.p += from.p;
    to.n += from.n;
    for (int half = 0; half < kHalves; ++half)
        to.count[half] += from.count[half];
    for (auto& ofPart : m_pyramid.m_light)
        for (int c = 0; c < NodeLight::kChannels && !ofPart.empty(); ++c)
            ofPart[from.parent].of[c] += ofPart[node].of[c];
}

} // namespace strobe
