// The parameters of msaa-cache, and its two families of behaviour.
#pragma once

#include "integrators/surface_lattice.h"

#include <optional>

namespace strobe {

struct CacheSettings {
    /// Who sees a shaded block. Shared: everyone, and a block is a function of its key. The others are the
    /// paper's, whose blocks are what their first ray makes them: a cache of each thread, one behind a mutex,
    /// or one of each tile.
    enum class Scope { Shared, Thread, Mutex, Tile };
    Scope scope;
    float blockSize; ///< pixels
    int shades, timeBins;
    bool nearest;
    size_t bytes;
};

/// Blocks that are functions of their key: see SurfaceLattice.
std::unique_ptr<IntegratorRender> beginLatticeSharing(const Scene& scene, const CacheSettings& settings,
                                                      uint64_t seed);
/// How many block sizes away, at most, a sample's value may come from there: two blocks, each as long as a
/// cell of the lattice may be.
inline constexpr float kFirstRayReach = 2 * SurfaceLattice::kReach;
/// Blocks that their first rays decide, as in "Multisampling and Motion Blur in a Ray Tracer", Algorithm 2.
/// Pixels depend on which thread came first.
std::unique_ptr<IntegratorRender> beginFirstRaySharing(const Scene& scene, const CacheSettings& settings);

} // namespace strobe
