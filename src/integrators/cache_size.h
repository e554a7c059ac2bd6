// The size of an integrator's cache.
#pragma once

#include "core/params/params.h"
#include "core/render/integrator.h"

namespace strobe {

/// The value of the parameter cache-mb: a number, "unbounded" or "auto".
struct CacheSize {
    static const ParamDef<std::string> kParam;
    /// `param` defines cache-mb; its description may be that of one integrator. Throws Error if the value is
    /// not a number, "unbounded" or "auto", or if it is negative or more than availableMemory.
    explicit CacheSize(const ParamSet& params, const ParamDef<std::string>& param = kParam);

    size_t bytes = SIZE_MAX;  ///< SIZE_MAX: unbounded
    bool isAutomatic = false; ///< `bytes` is to be replaced by the integrator's choice
};

/// Returns the bytes of physical memory, or of the process's limit (--max-memory) if that is less.
size_t availableMemory();

/// Returns a size for a RadianceCache. A render is expected to need max(1, 1/blockSize²) shading points per
/// pixel and time bin; there is space for twice as many. If `threadsKeepValues`
/// (BatchLattice::Settings::keepsValues) there is space for half as many, because values that a thread does
/// not keep are seldom looked up again. The size is at most a quarter of the memory. If a shade costs less
/// than a memory access, the size is 1 MB per thread, the size of a processor's cache. ("Multisampling and
/// Motion Blur in a Ray Tracer", Section 2.3: "cycle counting the average and standard deviation for a set of
/// typical shades would give a good indication of how much space to dedicate to the cache, and which level of
/// the memory hierarchy".)
size_t automaticCacheBytes(const RenderContext& context, float blockSize, int timeBins,
                           bool threadsKeepValues);

} // namespace strobe
