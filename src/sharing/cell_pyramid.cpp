#include "sharing/cell_pyramid.h"

#include "core/util/parallel.h"

#include <algorithm>
#include <numeric>

namespace strobe {

/// Sets m_blocks: the cubes with cubes of a fourth of the size.
void CellPyramid::indexBlocks() {
    constexpr size_t kRun = 4096;
    std::vector<std::vector<uint32_t>> blocks((m_cubes.size() + kRun - 1) / kRun);
    static_assert(kGenerations == 2);
    const auto has = [&](const Cube& cube, const auto& condition) {
        return std::any_of(std::begin(cube.children), std::end(cube.children),
                           [&](uint32_t child) { return child != kAbsent && condition(m_cubes[child]); });
    };
    parallelFor(blocks.size(), [&](size_t run) {
        for (size_t i = run * kRun; i < std::min(m_cubes.size(), (run + 1) * kRun); ++i)
            if (has(m_cubes[i],
                    [&](const Cube& child) { return has(child, [](const Cube&) { return true; }); }))
                blocks[run].push_back(uint32_t(i));
    });
    size_t count = 0;
    for (const auto& ofRun : blocks)
        count += ofRun.size();
    m_blocks = IndexTable(count);
    for (const auto& ofRun : blocks)
        for (const uint32_t cube : ofRun)
            m_blocks.findOrInsert(m_cubes[cube].id.hash(), cube);
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

void CellPyramid::addLight(size_t cell, LightPart part, int half, const Rgb& light) {
    forEachAncestor(m_recorded[cell], [&](uint32_t index) {
        for (int c = 0; c < 3; ++c)
            m_light[int(part)][index].of[3 * half + c] += light[c] / m_nodes[index].count[half];
    });
}

std::vector<uint32_t> CellPyramid::cellsByNode() const {
    // The order of the cells, but for those of different faces.
    constexpr size_t kRun = 512;
    std::vector<uint32_t> out(m_recorded.size());
    parallelFor((out.size() + kRun - 1) / kRun, [&](size_t run) {
        const auto first = out.begin() + std::ptrdiff_t(run * kRun);
        const auto end = out.begin() + std::ptrdiff_t(std::min(out.size(), (run + 1) * kRun));
        std::iota(first, end, uint32_t(run * kRun));
        std::stable_sort(first, end, [&](uint32_t a, uint32_t b) {
            return m_nodes[m_recorded[a]].face < m_nodes[m_recorded[b]].face;
        });
    });
    return out;
}

} // namespace strobe
