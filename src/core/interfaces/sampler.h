// The interface of samplers: random numbers as a function of (domain, index, dimension).
#pragma once

#include "core/math/api.h"
#include "core/math/soa.h"

#include <memory>
#include <span>

namespace STROBE_API strobe {

/// The number of low bits of a domain that may number the parts of a larger sample set: see SampleRange.
inline constexpr int kPartBits = 8;

/// Returns the domain of the samples of a pixel. The lowest kPartBits bits are the Morton code of the pixel
/// in a block of 16x16 pixels, and the others a hash of the seed and the block. Samplers may thus let the
/// samples of the pixels of a block complement each other, so that means over neighboring pixels have less
/// noise (Ahmed and Wonka, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical
/// Ordering of Pixels", 2020).
uint64_t pixelDomain(uint64_t seed, int x, int y);

/// Samples first … first+n-1 of a sample set of `total` samples, such as the camera samples of a pixel, or
/// all light samples of a pixel. `domain` identifies the set: pixelDomain, or a hash of the seed and a key.
/// Sets of equal size whose domains differ in the kPartBits lowest bits only may be parts of a larger one.
struct SampleRange {
    uint64_t domain;
    uint32_t first;
    uint32_t n;
    uint32_t total;
};

/// Interface of samplers, which generate well-distributed random numbers in [0,1). Samplers have no state:
/// the same arguments give the same numbers, on any thread. The numbers of one (domain, dimension) are
/// stratified over the `total` samples of the set; samples beyond `total` are valid, but less well
/// distributed. Different dimensions are independent, and so are domains that differ in bits above the
/// kPartBits lowest.
class Sampler {
  public:
    virtual ~Sampler() = default;
    /// Returns the number of samples per pixel to use if `spp` are requested, e.g. the next power of two. The
    /// default returns `spp`.
    virtual int roundCount(int spp) const { return spp; }
    /// Writes the numbers of samples first … first+n-1 in dimension `dim` to out[0 … n-1], each in [0,1).
    virtual void fill1D(const SampleRange& range, uint32_t dim, float* out) const = 0;
    /// Writes the points of samples first … first+n-1 in the two-dimensional dimension `dim` to out[0 … n-1],
    /// each in [0,1)². Two-dimensional dimensions are independent of one-dimensional ones with the same
    /// number.
    virtual void fill2D(const SampleRange& range, uint32_t dim, V2f* out) const = 0;

    /// Write the numbers of several ranges, one range after the other, kSoAWidth numbers at most; same
    /// results as the functions for one range, to the bit.
    virtual void fill1D(std::span<const SampleRange> ranges, uint32_t dim, float* out) const;
    virtual void fill2D(std::span<const SampleRange> ranges, uint32_t dim, V2SoA& out) const;

    /// Returns the number of a single sample, in [0,1).
    float get1D(uint64_t domain, uint32_t index, uint32_t total, uint32_t dim) const {
        float u;
        fill1D({domain, index, 1, total}, dim, &u);
        return u;
    }
    /// Returns the point of a single sample, in [0,1)².
    V2f get2D(uint64_t domain, uint32_t index, uint32_t total, uint32_t dim) const {
        V2f u;
        fill2D({domain, index, 1, total}, dim, &u);
        return u;
    }
};

/// The result of a sampler plugin's `create`. The argument of `create` is the number of samples per pixel
/// given on the command line; 0 if there is none.
struct SamplerSetup {
    std::shared_ptr<const Sampler> sampler;
    int samplesPerPixel = 1;
};

} // namespace strobe
