// Hashes of integers. Random numbers are hashes of keys and do not depend on the state of a thread.
#pragma once

#include <cstdint>

namespace strobe {

/// A bijective 64-bit finalizer, with the constants published as "moremur".
inline uint64_t mix64(uint64_t x) {
    x ^= x >> 27;
    x *= 0x3C79AC492BA7B653ull;
    x ^= x >> 33;
    x *= 0x1C69B3F74AC4AE35ull;
    x ^= x >> 27;
    return x;
}
/// Returns the hash of the sequence that hashes to `h`, extended by `v`.
inline uint64_t hashCombine(uint64_t h, uint64_t v) { return mix64(h ^ (v * 0x9E3779B97F4A7C15ull + 1)); }
/// Returns a hash of a sequence of integers; depends on their order.
template <class... T>
uint64_t hashOf(T... values) {
    uint64_t h = 0x243F6A8885A308D3ull;
    ((h = hashCombine(h, static_cast<uint64_t>(values))), ...);
    return h;
}
/// The state of `fastHashOf` before any value.
inline constexpr uint64_t kEmptyFastHash = 0x3F84D5B5B5470917ull;
/// Appends `values` to `state`, the unmixed state of `fastHashOf`. kFirst is the number of values appended
/// before; at most six in all. Hashes with a common prefix can share its state: fastHashOf(a, b, c) =
/// mix64(appendFastHash<2>(appendFastHash<0>(kEmptyFastHash, a, b), c)).
template <int kFirst, class... T>
uint64_t appendFastHash(uint64_t state, T... values) {
    static_assert(kFirst + sizeof...(T) <= 6);
    constexpr uint64_t kOdd[] = {0x243F6A8885A308D3ull, 0x13198A2E03707345ull, 0xA4093822299F31D1ull,
                                 0x082EFA98EC4E6C89ull, 0x452821E638D01377ull, 0xBE5466CF34E90C6Dull};
    int i = kFirst;
    ((state += static_cast<uint64_t>(values) * kOdd[i++]), ...);
    return state;
}
/// Returns a hash of at most six integers; depends on their order. It is faster than `hashOf`: the values are
/// multiplied by odd constants (digits of pi), independently of each other, and their sum is mixed once.
template <class... T>
uint64_t fastHashOf(T... values) {
    return mix64(appendFastHash<0>(kEmptyFastHash, values...));
}
/// Converts 32 random bits to a float in [0, 1).
inline float unitFloat(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

} // namespace strobe
