#include "samplers/sobol.h"

#include "core/math/hash.h"

#include <bit>

namespace strobe {

namespace {

const ParamDef<int> kPixelSamples{
    "pixelsamples", 16,
    "number of samples per pixel, rounded up to a power of two; default under pbrt-v2's conventions: 4",
    "samples", kAtLeastOne};

inline uint32_t reverseBits(uint32_t x) {
    x = (x << 16) | (x >> 16);
    x = ((x & 0x00FF00FFu) << 8) | ((x >> 8) & 0x00FF00FFu);
    x = ((x & 0x0F0F0F0Fu) << 4) | ((x >> 4) & 0x0F0F0F0Fu);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

/// Returns the bit-reversed second Sobol' coordinate of an index, which is the bit-reversed first coordinate.
/// With the digits as coefficients of a polynomial p(s) over GF(2), the second coordinate is p(1 + s): the
/// generator matrix is Pascal's triangle. Because (1 + s)^16 = 1 + s^16 and so on, one masked shift per power
/// of two is sufficient.
inline uint32_t secondFromFirst(uint32_t x) {
    x ^= x >> 16;
    x ^= (x & 0xFF00FF00u) >> 8;
    x ^= (x & 0xF0F0F0F0u) >> 4;
    x ^= (x & 0xCCCCCCCCu) >> 2;
    return x ^ ((x & 0xAAAAAAAAu) >> 1);
}

/// Returns a hash of which each bit depends only on the same and lower bits of `x`: an Owen scramble of
/// bit-reversed numbers (Laine & Karras 2011 in the form of Burley, "Practical Hash-based Owen Scrambling",
/// 2020, with the constants of Vegdahl, which mix better).
inline uint32_t scrambleReversed(uint32_t x, uint32_t seed) {
    x ^= x * 0x3D20ADEAu;
    x += seed;
    x *= (seed >> 16) | 1;
    x ^= x * 0x05526C56u;
    x ^= x * 0x53A22864u;
    return x;
}

/// Converts 32 reversed bits to a float in [0,1): equals unitFloat, in a form that compilers vectorize.
inline float toFloat(uint32_t reversed) { return float(int32_t(reverseBits(reversed) >> 8)) * 0x1p-24f; }

/// Returns the index of member `index` in the shuffled sequence. An Owen scramble of the index keeps aligned
/// ranges of 2^m indices together, so that each remains a net.
inline uint32_t shuffle(uint32_t index, uint32_t seed) {
    return reverseBits(scrambleReversed(reverseBits(index), seed));
}

/// Returns the index of a member like `shuffle`, for one-dimensional points. The members are those of sets of
/// 2^setBits. The order of the sets is shuffled independently for each value of the first setBits bits of the
/// number. Otherwise, all sets of a sequence would miss some functions by the same pattern: in some blocks,
/// light that alternates with the shutter had no noise, and in others twice as much as it should.
inline uint32_t shuffleSets(uint32_t member, uint32_t seed, uint32_t setBits) {
    const uint32_t reversed = scrambleReversed(reverseBits(member), seed);
    const uint32_t stratum = (reversed >> 1) >> (31 - setBits); // setBits may be 0
    uint32_t setSeed = seed + stratum * 0x9E3779B9u;
    setSeed = (setSeed ^ (setSeed >> 16)) * 0x85EBCA6Bu;
    setSeed ^= setSeed >> 13;
    const uint32_t set = scrambleReversed(reversed << setBits, setSeed) >> setBits;
    return reverseBits((reversed & ~(~0u >> setBits)) | set);
}

/// The sample set of a domain: a range of a sequence. Sets of equal size whose domains differ in the
/// kPartBits lowest bits only are consecutive ranges of one sequence, so that together, they are a net.
struct SampleSet {
    uint64_t sequence;  ///< which of them
    uint32_t first = 0; ///< member
    uint32_t sizeBits;  ///< binary logarithm of its size, rounded up

    SampleSet(uint64_t domain, uint32_t total)
        : sequence(domain), sizeBits(uint32_t(std::bit_width(std::max(total, 1u) - 1))) {
        constexpr uint64_t kParts = uint64_t(1) << kPartBits, kOdd = 0x9e3779b97f4a7c15;
        if (sizeBits + kPartBits > 32)
            return; // more members than a sequence has
        first = uint32_t(domain % kParts) << sizeBits;
        sequence = domain / kParts + total * kOdd;
    }
};

/// The seeds of one sequence and dimension: for the shuffle and for the scrambles of both coordinates.
struct Seeds {
    uint32_t order, x, y;
};
inline Seeds seedsOf(uint64_t sequence, uint64_t dimension) {
    const uint64_t h = mix64(sequence + dimension);
    return {uint32_t(h), uint32_t(h >> 32), uint32_t(mix64(h))};
}
/// Returns the hash of a dimension. `coordinates`: 1 or 2.
inline uint64_t hashedDimension(uint32_t dim, int coordinates) { return hashOf(dim, coordinates); }

inline float number(uint32_t member, const Seeds& s, uint32_t setBits) {
    return toFloat(scrambleReversed(shuffleSets(member, s.order, setBits), s.x));
}
inline V2f point(uint32_t member, const Seeds& s) {
    const uint32_t index = shuffle(member, s.order); // equals the reversed first coordinate
    return {toFloat(scrambleReversed(index, s.x)), toFloat(scrambleReversed(secondFromFirst(index), s.y))};
}

STROBE_TARGET_CLONES void fillNumbers(uint32_t first, uint32_t n, Seeds seeds, uint32_t setBits, float* out) {
    STROBE_IVDEP
    for (uint32_t i = 0; i < n; ++i)
        out[i] = number(first + i, seeds, setBits);
}
STROBE_TARGET_CLONES void fillPoints(uint32_t first, uint32_t n, Seeds seeds, float* x, float* y) {
    STROBE_IVDEP
    for (uint32_t i = 0; i < n; ++i) {
        const V2f p = point(first + i, seeds);
        x[i] = p.x;
        y[i] = p.y;
    }
}

/// The members of several ranges, with the seeds of their domains.
struct MemberSoA {
    static constexpr int kUnroll = 4; ///< members stored at a time; the excess is overwritten or ignored
    static constexpr int kSize = kSoAWidth + kUnroll;
    alignas(64) uint32_t member[kSize], order[kSize], x[kSize], y[kSize], setBits[kSize];
    int n = 0;

    MemberSoA(std::span<const SampleRange> ranges, uint64_t dimension) {
        uint64_t sequence = SampleSet(ranges.front().domain, ranges.front().total).sequence;
        Seeds s = seedsOf(sequence, dimension);
        for (const SampleRange& range : ranges) {
            const SampleSet set(range.domain, range.total);
            if (set.sequence != sequence) { // neighboring ranges often have the same sequence
                sequence = set.sequence;
                s = seedsOf(sequence, dimension);
            }
            const uint32_t first = set.first + range.first;
            if (range.n == 1) { // for example bounces
                member[n] = first;
                order[n] = s.order;
                x[n] = s.x;
                y[n] = s.y;
                setBits[n] = set.sizeBits;
                ++n;
                continue;
            }
            for (uint32_t i = 0; i < range.n; i += kUnroll)
                for (uint32_t k = i; k < i + kUnroll; ++k) {
                    member[n + k] = first + k;
                    order[n + k] = s.order;
                    x[n + k] = s.x;
                    y[n + k] = s.y;
                    setBits[n + k] = set.sizeBits;
                }
            n += int(range.n);
        }
    }
};
STROBE_TARGET_CLONES void fillNumbers(const MemberSoA& m, float* out) {
    STROBE_IVDEP
    for (int i = 0; i < m.n; ++i)
        out[i] = number(m.member[i], {m.order[i], m.x[i], m.y[i]}, m.setBits[i]);
}
STROBE_TARGET_CLONES void fillPoints(const MemberSoA& m, V2SoA& out) {
    STROBE_IVDEP
    for (int i = 0; i < m.n; ++i) {
        const V2f p = point(m.member[i], {m.order[i], m.x[i], m.y[i]});
        out.x[i] = p.x;
        out.y[i] = p.y;
    }
}

class SobolSampler final : public Sampler {
  public:
    int roundCount(int spp) const override {
        return int(std::bit_ceil(uint32_t(std::clamp(spp, 1, 1 << 30))));
    }
    void fill1D(const SampleRange& range, uint32_t dim, float* out) const override {
        const SampleSet set(range.domain, range.total);
        fillNumbers(set.first + range.first, range.n, seedsOf(set.sequence, hashedDimension(dim, 1)),
                    set.sizeBits, out);
    }
    void fill2D(const SampleRange& range, uint32_t dim, V2f* out) const override {
        const SampleSet set(range.domain, range.total);
        const Seeds seeds = seedsOf(set.sequence, hashedDimension(dim, 2));
        for (uint32_t i = 0; i < range.n; ++i)
            out[i] = point(set.first + range.first + i, seeds);
    }
    void fill1D(std::span<const SampleRange> ranges, uint32_t dim, float* out) const override {
        const uint64_t dimension = hashedDimension(dim, 1);
        if (areShort(ranges))
            return fillNumbers(MemberSoA(ranges, dimension), out);
        for (const SampleRange& range : ranges) {
            const SampleSet set(range.domain, range.total);
            fillNumbers(set.first + range.first, range.n, seedsOf(set.sequence, dimension), set.sizeBits,
                        out);
            out += range.n;
        }
    }
    void fill2D(std::span<const SampleRange> ranges, uint32_t dim, V2SoA& out) const override {
        const uint64_t dimension = hashedDimension(dim, 2);
        if (areShort(ranges))
            return fillPoints(MemberSoA(ranges, dimension), out);
        uint32_t offset = 0;
        for (const SampleRange& range : ranges) {
            const SampleSet set(range.domain, range.total);
            fillPoints(set.first + range.first, range.n, seedsOf(set.sequence, dimension), out.x + offset,
                       out.y + offset);
            offset += range.n;
        }
    }

  private:
    /// Returns true if one loop over the members of all ranges is faster than a loop per range.
    static bool areShort(std::span<const SampleRange> ranges) {
        return ranges.size() > 1 && ranges.front().n < 16;
    }
};

SamplerSetup createSobol(const ParamSet& params, const BuildContext& context, int sppOverride) {
    int spp = params.get(kPixelSamples);
    if (!params.has(kPixelSamples) && context.conventions == Conventions::PbrtV2)
        spp = 4;
    auto sampler = std::make_shared<SobolSampler>();
    const int rounded = sampler->roundCount(sppOverride > 0 ? sppOverride : spp);
    if (sppOverride <= 0 && rounded != spp)
        context.diagnostics.note(params.whereIs(kPixelSamples),
                                 std::to_string(spp) + " samples per pixel become " +
                                     std::to_string(rounded) + ", a power of two");
    return {std::move(sampler), rounded};
}

} // namespace

SobolPoint sobolPoint(uint32_t index) { return {reverseBits(index), reverseBits(secondFromFirst(index))}; }

Plugin<SamplerSetup, int> sobolPlugin() {
    return {"sobol",
            "Owen-scrambled (0,2)-sequences, one for each block of 16x16 pixels (also replaces the "
            "low-discrepancy samplers of pbrt)",
            {kPixelSamples},
            createSobol};
}

} // namespace strobe
