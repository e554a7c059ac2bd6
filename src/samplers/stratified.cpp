#include "samplers/stratified.h"

#include "core/math/hash.h"

namespace strobe {

namespace {

const ParamDef<int> kXSamples{"xsamples", 4, "number of strata in x per pixel", nullptr, kAtLeastOne};
const ParamDef<int> kYSamples{"ysamples", 4, "number of strata in y per pixel", nullptr, kAtLeastOne};
const ParamDef<bool> kJitter{"jitter", true,
                             "random positions within the strata; false: the centers of the strata"};

/// A grid of strata for `total` points.
struct Grid {
    uint32_t nx, ny;
};

class StratifiedSampler final : public Sampler {
  public:
    StratifiedSampler(uint32_t nx, uint32_t ny, bool jitter) : m_pixelGrid{nx, ny}, m_jitter(jitter) {}

    void fill1D(const SampleRange& range, uint32_t dim, float* out) const override {
        const uint32_t total = std::max(range.total, 1u);
        for (uint32_t i = 0; i < range.n; ++i) {
            const uint32_t index = range.first + i;
            const uint64_t set =
                hashOf(range.domain, dim, 1, index / total); // members beyond `total` form further sets
            const uint32_t cell = permutedIndex(index % total, total, set);
            out[i] = stratumPoint(cell, jitter(hashCombine(set, cell)), total);
        }
    }

    void fill2D(const SampleRange& range, uint32_t dim, V2f* out) const override {
        const uint32_t total = std::max(range.total, 1u);
        const Grid grid = gridFor(total);
        for (uint32_t i = 0; i < range.n; ++i) {
            const uint32_t index = range.first + i;
            const uint64_t set = hashOf(range.domain, dim, 2, index / total);
            out[i] = point(permutedIndex(index % total, grid.nx * grid.ny, set), grid, set);
        }
    }

  private:
    /// Returns the grid of the pixel if it has `total` cells; otherwise the smallest nearly square grid with
    /// at least `total` cells, of which a random choice remains empty, so that every point is uniform.
    Grid gridFor(uint32_t total) const {
        if (total == m_pixelGrid.nx * m_pixelGrid.ny)
            return m_pixelGrid;
        const uint32_t nx = std::max(1u, static_cast<uint32_t>(std::sqrt(float(total))));
        return {nx, (total + nx - 1) / nx};
    }

    V2f point(uint32_t cell, const Grid& grid, uint64_t set) const {
        const uint32_t cx = cell % grid.nx, cy = cell / grid.nx;
        const uint64_t random = hashCombine(set, cell + 1);
        const float jx = jitter(random), jy = jitter(random >> 32);
        if (!m_jitter)
            return {stratumPoint(cx, jx, grid.nx), stratumPoint(cy, jy, grid.ny)};
        // Substrata: all cells of a column have different substrata in x, all cells of a row in y.
        const uint32_t sx = permutedIndex(cy, grid.ny, hashCombine(set, ~0ull));
        const uint32_t sy = permutedIndex(cx, grid.nx, hashCombine(set, ~1ull));
        return {stratumPoint(cx * grid.ny + sx, jx, grid.nx * grid.ny),
                stratumPoint(cy * grid.nx + sy, jy, grid.nx * grid.ny)};
    }

    float jitter(uint64_t random) const { return m_jitter ? unitFloat(static_cast<uint32_t>(random)) : .5f; }
    /// Returns the point at fraction `offset` of stratum `cell` of n.
    static float stratumPoint(uint32_t cell, float offset, uint32_t n) {
        return std::min((float(cell) + offset) / float(n), kOneMinusEpsilon);
    }

    Grid m_pixelGrid;
    bool m_jitter;
};

SamplerSetup createStratified(const ParamSet& params, const BuildContext&, int sppOverride) {
    int nx = params.get(kXSamples), ny = params.get(kYSamples);
    if (double(nx) * ny > double(1 << 24))
        throw Error(params.whereIs(kYSamples), "\"xsamples\" times \"ysamples\" must be at most 16777216");
    if (sppOverride > 0 && sppOverride != nx * ny) { // the most nearly square grid with this number of cells
        for (nx = static_cast<int>(std::sqrt(double(sppOverride))); sppOverride % nx != 0;)
            --nx;
        ny = sppOverride / nx;
    }
    return {std::make_shared<StratifiedSampler>(uint32_t(nx), uint32_t(ny), params.get(kJitter)), nx * ny};
}

} // namespace

uint32_t permutedIndex(uint32_t index, uint32_t n, uint64_t seed) {
    // Swap-or-not shuffle (Hoang, Morris & Rogaway 2012): each round pairs all positions and swaps each pair
    // depending on a hash. The remaining correlation with the initial order halves with each round.
    constexpr int kRounds = 16;
    uint64_t state = mix64(seed);
    uint32_t x = index;
    for (int r = 0; r < kRounds; ++r) {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        const uint32_t sum = uint32_t(((state >> 32) * n) >> 32), key = uint32_t(state >> 11);
        const uint32_t partner = sum >= x ? sum - x : sum + n - x;
        const uint32_t coin = (std::max(x, partner) ^ key) * (uint32_t(state >> 24) | 1);
        x = coin >> 31 ? partner : x;
    }
    return x;
}

Plugin<SamplerSetup, int> stratifiedPlugin() {
    return {"stratified",
            "jittered strata, xsamples * ysamples per pixel",
            {kXSamples, kYSamples, kJitter},
            createStratified};
}

} // namespace strobe
