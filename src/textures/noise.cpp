#include "textures/noise.h"

#include <array>
#include <cstdint>

namespace strobe {
namespace {

/// The permutation of Perlin's reference implementation, which fixes the pattern.
constexpr std::array<uint8_t, 256> kPermutation{
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,
    69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,
    94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136,
    171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122,
    60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161,
    1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130, 116, 188, 159, 86,
    164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126,
    255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213,
    119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,   129, 22,  39,  253,
    19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193,
    238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,
    222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

/// The frequency of an octave relative to the previous one: not 2, so that their zeros do not coincide.
constexpr float kLacunarity = 1.99f;

/// Returns the dot product of the gradient at a lattice point and the offset `d` from it.
float gradient(int x, int y, int z, const V3f& d) {
    const auto permuted = [](int i) { return int(kPermutation[size_t(i & 255)]); };
    const int h = permuted(permuted(permuted(x) + y) + z) & 15;
    const bool isEdge = h == 12 || h == 13;
    const float u = h < 8 || isEdge ? d.x : d.y, v = h < 4 || isEdge ? d.y : d.z;
    return ((h & 1) ? -u : u) + ((h & 2) ? -v : v);
}

float fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }

float smoothStep(float x, float from, float to) {
    const float t = std::clamp((x - from) / (to - from), 0.f, 1.f);
    return t * t * (3 - 2 * t);
}

/// The octaves below the Nyquist frequency of a footprint: `whole` ones, and the next with weight `partial`.
struct VisibleOctaves {
    int whole;
    float partial;

    VisibleOctaves(float width, const Octaves& octaves) {
        const float n =
            std::clamp(width > 0 ? -1 - std::log2(width) : float(octaves.count), 0.f, float(octaves.count));
        whole = int(n);
        partial = smoothStep(n - float(whole), .3f, .7f);
    }
};

} // namespace

Octaves readOctaves(const ParamSet& params) {
    const Octaves octaves{params.get(kOctaves), params.get(kOctaveRoughness)};
    if (octaves.count < 0 || octaves.count > 32)
        throw Error(params.whereIs(kOctaves), "\"octaves\" must be 0 to 32");
    return octaves;
}

float noise(const V3f& p) {
    const auto wrapped = [](float x) { return std::fmod(x, 256.f); }; // the period; an int holds the result
    const V3f q(wrapped(p.x), wrapped(p.y), wrapped(p.z));
    const V3f cell(std::floor(q.x), std::floor(q.y), std::floor(q.z)), d = q - cell;
    if (!std::isfinite(d.x + d.y + d.z))
        return d.x + d.y + d.z;
    const int x = int(cell.x), y = int(cell.y), z = int(cell.z);
    const float wx = fade(d.x), wy = fade(d.y), wz = fade(d.z);
    const auto alongX = [&](int j, int k) {
        const V3f corner(d.x, d.y - float(j), d.z - float(k));
        return lerp(gradient(x, y + j, z + k, corner), gradient(x + 1, y + j, z + k, corner - V3f(1, 0, 0)),
                    wx);
    };
    return lerp(lerp(alongX(0, 0), alongX(1, 0), wy), lerp(alongX(0, 1), alongX(1, 1), wy), wz);
}

float fbm(const V3f& p, float width, const Octaves& octaves) {
    const VisibleOctaves visible(width, octaves);
    float sum = 0, frequency = 1, weight = 1;
    for (int i = 0; i < visible.whole; ++i) {
        sum += weight * noise(p * frequency);
        frequency *= kLacunarity;
        weight *= octaves.roughness;
    }
    return sum + weight * visible.partial * noise(p * frequency);
}

float turbulence(const V3f& p, float width, const Octaves& octaves) {
    constexpr float kMean = 0.2f; // of the magnitude of noise
    const VisibleOctaves visible(width, octaves);
    float sum = 0, frequency = 1, weight = 1;
    for (int i = 0; i < visible.whole; ++i) {
        sum += weight * std::abs(noise(p * frequency));
        frequency *= kLacunarity;
        weight *= octaves.roughness;
    }
    sum += weight * lerp(kMean, std::abs(noise(p * frequency)), visible.partial);
    for (int i = visible.whole + 1; i < octaves.count; ++i) {
        weight *= octaves.roughness;
        sum += weight * kMean;
    }
    return sum;
}

} // namespace strobe
