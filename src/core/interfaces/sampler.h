// The sampler seam: random numbers as a function of (domain, index, dimension).
#pragma once

#include "core/math/soa.h"

#include <memory>
#include <span>

namespace strobe {

/// `n` consecutive members `first … first+n-1` of a set of `total` samples that belong together (a pixel's
/// camera samples; all light samples of a pixel). `domain` names the set: a hash of seed and pixel, or of
/// seed and cache block. A sampler spreads the `total` samples of one (domain, dimension) evenly.
struct SampleRange {
    uint64_t domain;
    uint32_t first;
    uint32_t n;
    uint32_t total;
};

/// A source of well-spread random numbers in [0, 1). Stateless: the same arguments give the same numbers on
/// any thread. Different dimensions (and domains) are independent. Members beyond `total` are legal and
/// merely less well spread.
class Sampler {
  public:
    virtual ~Sampler() = default;
    /// The number of samples per pixel to use when `spp` are asked for (e.g. the next power of two).
    virtual int roundCount(int spp) const { return spp; }
    /// out[i] = number of member first+i in dimension `dim`, each in [0, 1).
    virtual void fill1D(const SampleRange& range, uint32_t dim, float* out) const = 0;
    /// out[i] = point of member first+i in the two-dimensional dimension `dim`, in [0, 1)².
    virtual void fill2D(const SampleRange& range, uint32_t dim, V2f* out) const = 0;

    /// The numbers of several ranges, one after the other: kSoAWidth in all at most. The same numbers as
    /// above.
    virtual void fill1D(std::span<const SampleRange> ranges, uint32_t dim, float* out) const;
    virtual void fill2D(std::span<const SampleRange> ranges, uint32_t dim, V2SoA& out) const;

    float get1D(uint64_t domain, uint32_t index, uint32_t total, uint32_t dim) const {
        float u;
        fill1D({domain, index, 1, total}, dim, &u);
        return u;
    }
    V2f get2D(uint64_t domain, uint32_t index, uint32_t total, uint32_t dim) const {
        V2f u;
        fill2D({domain, index, 1, total}, dim, &u);
        return u;
    }
};

/// What a sampler plugin makes. Its `create` takes the number of samples that the command line asks for (0:
/// as the scene says) as its argument.
struct SamplerSetup {
    std::shared_ptr<const Sampler> sampler;
    int samplesPerPixel = 1;
};

} // namespace strobe
