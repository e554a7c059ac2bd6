#include "sharing/surface_scales.h"

#include "core/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace strobe {

namespace {

/// Consecutive cells of one surface, and the box around them.
struct Piece {
    uint64_t surface;
    size_t begin, end;
    V3f low{std::numeric_limits<float>::infinity()}, high{-std::numeric_limits<float>::infinity()};

    void add(const V3f& p) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], p[axis]);
            high[axis] = std::max(high[axis], p[axis]);
        }
    }
    void add(const Piece& next) {
        end = next.end;
        add(next.low);
        add(next.high);
    }
    float longestEdge() const { return std::max({high.x - low.x, high.y - low.y, high.z - low.z}); }
};

/// Returns the pieces of some consecutive cells.
std::vector<Piece> piecesOf(const CellPyramid& pyramid, size_t begin, size_t end) {
    std::vector<Piece> out;
    for (size_t cell = begin; cell < end; ++cell) {
        const CellNode& node = pyramid.nodes()[pyramid.nodeOf(cell)];
        const uint64_t surface = pyramid.surfaceOf(node);
        if (out.empty() || out.back().surface != surface)
            out.push_back({surface, cell, cell});
        out.back().add(node.p);
        out.back().end = cell + 1;
    }
    return out;
}

/// Returns one piece for each surface.
std::vector<Piece> findSurfaces(const CellPyramid& pyramid) {
    constexpr size_t kRun = 4096;
    std::vector<std::vector<Piece>> runs((pyramid.cellCount() + kRun - 1) / kRun);
    parallelFor(runs.size(), [&](size_t run) {
        runs[run] = piecesOf(pyramid, run * kRun, std::min(pyramid.cellCount(), (run + 1) * kRun));
    });
    std::vector<Piece> out;
    for (const auto& run : runs)
        for (const Piece& piece : run)
            if (!out.empty() && out.back().surface == piece.surface)
                out.back().add(piece);
            else
                out.push_back(piece);
    return out;
}

} // namespace

HugeVector<uint8_t> surfaceScales(const CellPyramid& pyramid) {
    HugeVector<uint8_t> out(pyramid.cellCount());
    const std::vector<Piece> surfaces = findSurfaces(pyramid);
    parallelFor(surfaces.size(), [&](size_t i) {
        const float least = surfaces[i].longestEdge() / 4;
        for (size_t cell = surfaces[i].begin; cell < surfaces[i].end; ++cell) {
            float edge = pyramid.edge(pyramid.nodes()[pyramid.nodeOf(cell)]);
            for (; out[cell] < CellPyramid::kScales && edge < least; edge *= 2)
                ++out[cell];
        }
    });
    return out;
}

} // namespace strobe
