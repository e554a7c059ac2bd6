// Stateless random numbers: hashes of keys, never of a thread's history.
#pragma once

#include <cstdint>

namespace strobe {

/// A bijective 64-bit finaliser (the constants are those published as "moremur").
inline uint64_t mix64(uint64_t x) {
    x ^= x >> 27;
    x *= 0x3C79AC492BA7B653ull;
    x ^= x >> 33;
    x *= 0x1C69B3F74AC4AE35ull;
    x ^= x >> 27;
    return x;
}
inline uint64_t hashCombine(uint64_t h, uint64_t v) { return mix64(h ^ (v * 0x9E3779B97F4A7C15ull + 1)); }
/// Hash of any number of integers, order-sensitive.
template <class... T>
uint64_t hashOf(T... values) {
    uint64_t h = 0x243F6A8885A308D3ull;
    ((h = hashCombine(h, static_cast<uint64_t>(values))), ...);
    return h;
}
/// The sum that `quickHashOf` mixes, with more integers added: of its values, those from number kFirst on.
template <int kFirst, class... T>
uint64_t quickSum(uint64_t sum, T... values) {
    static_assert(kFirst + sizeof...(T) <= 6);
    constexpr uint64_t kOdd[] = {0x243F6A8885A308D3ull, 0x13198A2E03707345ull, 0xA4093822299F31D1ull,
                                 0x082EFA98EC4E6C89ull, 0x452821E638D01377ull, 0xBE5466CF34E90C6Dull};
    int i = kFirst;
    ((sum += static_cast<uint64_t>(values) * kOdd[i++]), ...);
    return sum;
}
inline constexpr uint64_t kEmptyQuickSum = 0x3F84D5B5B5470917ull; ///< of no values
/// A faster hash of a fixed number of integers, order-sensitive: they are mixed once, after a sum of products
/// with odd numbers (digits of pi), which takes the processor's multipliers side by side.
template <class... T>
uint64_t quickHashOf(T... values) {
    return mix64(quickSum<0>(kEmptyQuickSum, values...));
}
/// 32 random bits to a float in [0, 1).
inline float unitFloat(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

} // namespace strobe
