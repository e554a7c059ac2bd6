// The parameters of the integrators that cache, and their two families of behavior.
#pragma once

#include "lattice/surface_lattice.h"

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
    bool indirectOnly = false;        ///< scope shared: every sample has its own direct light
    bool shadesFollowSamples = false; ///< scope shared: `shades` is the number of samples per pixel
    int lightComponents = 0;          ///< of radiance, beside its whole: see LightComponents
};

/// Bytes of a cache as its user said it, or left it to us.
struct CacheSize {
    /// Reads cache-mb: a number, "unbounded" or "auto".
    explicit CacheSize(const ParamSet& params);
    size_t bytes = SIZE_MAX; ///< unbounded
    bool automatic = false;
    static const ParamDef<std::string> kParam;
};
/// Of all the blocks that the picture can be expected to need (the points of its pixels), twice the size; or
/// half of it if threads remember the latest themselves: the others are seldom asked for again. A quarter of
/// the machine's memory at most; but if a shade costs no more than fetching it from memory, no larger than a
/// processor's own cache. (The paper, Section 2.3: "cycle counting the average and standard deviation for a
/// set of typical shades would give a good indication of how much space to dedicate to the cache, and which
/// level of the memory hierarchy".)
size_t automaticBytes(const RenderContext& context, float blockSize, int timeBins, bool remembered);

/// The value that a word stands for; anything else is an error that lists the words.
template <class T>
T oneOf(const ParamSet& params, const ParamDef<std::string>& def,
        std::initializer_list<std::pair<const char*, T>> values) {
    const std::string word = params.get(def);
    std::string known;
    for (const auto& [name, value] : values) {
        if (word == name)
            return value;
        known += (known.empty() ? "" : ", ") + std::string(name);
    }
    throw Error(params.whereIs(def),
                std::string("\"") + def.name + "\" cannot be \"" + word + "\" (known: " + known + ")");
}

/// Blocks that are functions of their key: see SurfaceLattice.
std::unique_ptr<IntegratorState> beginLatticeSharing(const Scene& scene, const CacheSettings& settings,
                                                     uint64_t seed);
/// How many block sizes away, at most, a sample's value may come from there: two blocks, each as long as a
/// cell of the lattice may be.
inline constexpr float kFirstRayReach = 2 * SurfaceLattice::kReach;
/// Blocks that their first rays decide, as in "Multisampling and Motion Blur in a Ray Tracer", Algorithm 2.
/// Pixels depend on which thread came first.
std::unique_ptr<IntegratorState> beginFirstRaySharing(const Scene& scene, const CacheSettings& settings);

} // namespace strobe
