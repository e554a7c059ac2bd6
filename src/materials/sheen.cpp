#include "materials/sheen.h"

namespace strobe {
namespace {

constexpr int kSize = 16;
/// The albedo, integrated numerically: rows of equal roughness from 0.07 to 1, columns of equal cosine from 0
/// to 1.
constexpr float kAlbedo[kSize][kSize] = {
    {5.4607f, 1.3428f, 0.3803f, 0.0978f, 0.0215f, 0.0039f, 0.0006f, 0.0001f, 0.0000f, 0.0000f, 0.0000f,
     0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f},
    {2.9793f, 1.3285f, 0.6851f, 0.3540f, 0.1778f, 0.0853f, 0.0386f, 0.0162f, 0.0062f, 0.0021f, 0.0006f,
     0.0001f, 0.0000f, 0.0000f, 0.0000f, 0.0000f},
    {2.0724f, 1.1590f, 0.7335f, 0.4717f, 0.3015f, 0.1894f, 0.1160f, 0.0686f, 0.0388f, 0.0207f, 0.0103f,
     0.0046f, 0.0018f, 0.0005f, 0.0001f, 0.0000f},
    {1.6080f, 1.0149f, 0.7133f, 0.5110f, 0.3666f, 0.2611f, 0.1833f, 0.1262f, 0.0846f, 0.0548f, 0.0339f,
     0.0197f, 0.0105f, 0.0049f, 0.0017f, 0.0003f},
    {1.3291f, 0.9044f, 0.6775f, 0.5178f, 0.3975f, 0.3043f, 0.2310f, 0.1732f, 0.1276f, 0.0918f, 0.0641f,
     0.0429f, 0.0270f, 0.0155f, 0.0075f, 0.0023f},
    {1.1455f, 0.8201f, 0.6413f, 0.5116f, 0.4106f, 0.3294f, 0.2630f, 0.2081f, 0.1627f, 0.1251f, 0.0940f,
     0.0685f, 0.0478f, 0.0312f, 0.0182f, 0.0083f},
    {1.0170f, 0.7551f, 0.6087f, 0.5005f, 0.4145f, 0.3436f, 0.2840f, 0.2334f, 0.1901f, 0.1528f, 0.1208f,
     0.0932f, 0.0697f, 0.0496f, 0.0327f, 0.0186f},
    {0.9232f, 0.7042f, 0.5807f, 0.4883f, 0.4138f, 0.3514f, 0.2979f, 0.2516f, 0.2110f, 0.1753f, 0.1436f,
     0.1156f, 0.0907f, 0.0687f, 0.0493f, 0.0322f},
    {0.8523f, 0.6638f, 0.5569f, 0.4764f, 0.4108f, 0.3553f, 0.3072f, 0.2648f, 0.2271f, 0.1933f, 0.1628f,
     0.1352f, 0.1101f, 0.0873f, 0.0665f, 0.0476f},
    {0.7976f, 0.6313f, 0.5369f, 0.4655f, 0.4069f, 0.3570f, 0.3133f, 0.2745f, 0.2396f, 0.2078f, 0.1788f,
     0.1521f, 0.1274f, 0.1046f, 0.0833f, 0.0635f},
    {0.7543f, 0.6048f, 0.5201f, 0.4557f, 0.4028f, 0.3574f, 0.3175f, 0.2817f, 0.2493f, 0.2195f, 0.1921f,
     0.1665f, 0.1427f, 0.1203f, 0.0991f, 0.0792f},
    {0.7196f, 0.5831f, 0.5058f, 0.4471f, 0.3987f, 0.3571f, 0.3203f, 0.2872f, 0.2570f, 0.2291f, 0.2032f,
     0.1789f, 0.1560f, 0.1343f, 0.1137f, 0.0939f},
    {0.6913f, 0.5650f, 0.4937f, 0.4395f, 0.3949f, 0.3563f, 0.3222f, 0.2914f, 0.2632f, 0.2370f, 0.2126f,
     0.1895f, 0.1677f, 0.1468f, 0.1268f, 0.1076f},
    {0.6680f, 0.5498f, 0.4834f, 0.4329f, 0.3913f, 0.3554f, 0.3235f, 0.2947f, 0.2682f, 0.2436f, 0.2205f,
     0.1986f, 0.1778f, 0.1579f, 0.1387f, 0.1200f},
    {0.6485f, 0.5371f, 0.4746f, 0.4272f, 0.3881f, 0.3543f, 0.3244f, 0.2973f, 0.2723f, 0.2491f, 0.2272f,
     0.2065f, 0.1867f, 0.1676f, 0.1492f, 0.1313f},
    {0.6322f, 0.5262f, 0.4669f, 0.4221f, 0.3852f, 0.3533f, 0.3250f, 0.2993f, 0.2757f, 0.2537f, 0.2330f,
     0.2133f, 0.1944f, 0.1762f, 0.1586f, 0.1414f}};

/// Returns the tabulated albedo, which may exceed 1 at grazing angles.
float unlimitedAlbedo(float cosine, float roughness) {
    const float x = std::clamp(cosine, 0.f, 1.f) * (kSize - 1);
    const float y = (std::clamp(roughness, .07f, 1.f) - .07f) / .93f * (kSize - 1);
    const int i = std::min(int(x), kSize - 2), j = std::min(int(y), kSize - 2);
    const float u = x - float(i), v = y - float(j);
    return (kAlbedo[j][i] * (1 - u) + kAlbedo[j][i + 1] * u) * (1 - v) +
           (kAlbedo[j + 1][i] * (1 - u) + kAlbedo[j + 1][i + 1] * u) * v;
}

} // namespace

float sheenAlbedo(float cosine, float roughness) { return std::min(unlimitedAlbedo(cosine, roughness), 1.f); }

float sheenBrdf(float cosO, float cosI, float cosHalf, float roughness) {
    const float exponent = 1 / sheenAlpha(roughness);
    const float sin2 = std::max(0.f, 1 - sqr(cosHalf));
    const float distribution = (2 + exponent) * std::pow(sin2, exponent / 2) / (2 * kPi);
    const float visibility = 1 / (4 * (cosO + cosI - cosO * cosI));
    const float excess = std::max({1.f, unlimitedAlbedo(cosO, roughness), unlimitedAlbedo(cosI, roughness)});
    return distribution * visibility / excess;
}

} // namespace strobe
