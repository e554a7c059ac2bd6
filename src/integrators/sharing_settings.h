// The settings of the integrators that share shades through a cache, and the two implementations of their
// sharing.
#pragma once

#include "core/render/integrator.h"
#include "lattice/surface_lattice.h"

namespace strobe {

struct SharingSettings {
    /// Which samples use a shade. Shared: all samples, from a cache whose values are functions of their keys.
    /// The others are the paper's caches, whose blocks are shaded by the first rays that hit them: one cache
    /// per thread, one for all threads behind a mutex, or one per tile.
    enum class Scope { Shared, Thread, Mutex, Tile };
    Scope scope = Scope::Shared;
    float blockSize = 1; ///< pixels; 0: no sharing
    int shades = 1;      ///< per shading point or block
    int timeBins = 1;
    bool nearest = false; ///< a sample uses the nearest point or block, not a weighted mean
    size_t cacheBytes = SIZE_MAX;
    // Scope Shared only:
    bool indirectOnly = false;        ///< each sample has its own direct light
    bool shadesFollowSamples = false; ///< `shades` is the number of samples per pixel
    int lightComponents = 0; ///< components of radiance to store beside the whole: see LightComponents
};

/// Begins a render with scope Shared: samples interpolate between points of a SurfaceLattice.
std::unique_ptr<IntegratorState> beginLatticeSharing(const Scene& scene, const SharingSettings& settings,
                                                     uint64_t seed);

/// BiasBound::reachPixels of beginFirstRaySharing, in blocks: two blocks, each as long as a cell of the
/// lattice may be.
inline constexpr float kFirstRayReach = 2 * SurfaceLattice::kReach;
/// Begins a render with one of the paper's scopes, as in Algorithm 2 of "Multisampling and Motion Blur in a
/// Ray Tracer". Pixels depend on the order in which threads render.
std::unique_ptr<IntegratorState> beginFirstRaySharing(const Scene& scene, const SharingSettings& settings);

} // namespace strobe
