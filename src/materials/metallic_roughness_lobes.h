// The lobes of the "metallicroughness" material, for one direction to the viewer. Included by
// metallic_roughness.cpp only.
#pragma once

#include "core/interfaces/material.h"
#include "core/math/sampling.h"
#include "materials/inputs.h"
#include "materials/microfacet.h"
#include "materials/sheen.h"
#include "materials/thin_film.h"

namespace strobe::metallic_roughness {

/// Lobes with a smaller alpha are perfect mirrors: their density exceeds the precision of float, and the
/// difference is not visible.
inline constexpr float kMinAlpha = 1e-3f;

/// The parameters at a surface point.
struct Data {
    PlainRgb diffuse; ///< albedo / π
    PlainRgb f0;      ///< reflectance at normal incidence, mixed from dielectric and metal
    float f90;        ///< reflectance at grazing incidence
    /// Reflectances of the dielectric alone, in the brightest channel; they reduce the light in its body.
    float dielectricF0, dielectricF90;
    float alpha, alphaV;   ///< of GGX along dp/du and dp/dv; 0: a mirror
    PlainRgb transmission; ///< albedo of the transmission
    float coat;            ///< strength of the clearcoat
    float coatAlpha;       ///< of GGX; 0: a mirror; negative: no coat, the body is below the boundary
    // Neutral unless the material has the extension:
    float turnCos, turnSin;               ///< of the direction of anisotropy
    PlainRgb sheen;                       ///< color of the sheen; black: none
    float sheenRoughness;                 ///< in [0,1]
    float film, filmIndex, filmThickness; ///< weight, index and nm of the thin film
    float coatX, coatY;                   ///< tilt of the clearcoat's normal: its x and y
};

/// Limits to [0,1].
inline float clamp01(float x) { return std::clamp(x, 0.f, 1.f); } // keeps NaN, which is reported per pixel
inline Rgb clamp01(const Rgb& c) { return {clamp01(c.x), clamp01(c.y), clamp01(c.z)}; }
/// Returns the alpha of a roughness; 0 for mirrors.
inline float alphaOf(float roughness) {
    const float alpha = sqr(clamp01(roughness));
    return alpha < kMinAlpha ? 0 : alpha;
}

/// Returns the alpha of the gloss for GgxReflection; not used for mirrors.
inline GgxAlpha glossAlpha(const Data& data) {
    return {std::max(data.alpha, kMinAlpha), std::max(data.alphaV, kMinAlpha)};
}
/// Returns whether the gloss is isotropic.
inline GgxAxes glossAxes(const Data& data) {
    return data.alpha == data.alphaV ? GgxAxes::TurnWithWo : GgxAxes::Fixed;
}

/// Returns Schlick's weight of f90 against f0: (1 - cosine)^5.
inline float schlick(float cosine) {
    const float x = 1 - std::min(cosine, 1.f), x2 = x * x;
    return x2 * x2 * x;
}
/// Returns the reflectance of the base.
inline Rgb fresnel(const Data& data, float cosine) {
    const float x = schlick(cosine);
    const Rgb base = Rgb(data.f0) * (1 - x) + Rgb(data.f90 * x);
    if (!(data.film > 0))
        return base;
    return base * (1 - data.film) +
           thinFilmReflectance(cosine, data.filmIndex, data.filmThickness, Rgb(data.f0)) * data.film;
}
/// Returns the fraction of light that passes the surface of the dielectric. It is independent of `metallic`,
/// because glTF mixes a complete dielectric with a metal (glTF 2.0, appendix B.2).
inline float dielectricTransmittance(const Data& data, float cosine) {
    if (data.film > 0)
        return 1 - maxComponent(fresnel(data, cosine));
    const float x = schlick(cosine);
    return 1 - (data.dielectricF0 * (1 - x) + data.dielectricF90 * x);
}
/// Whether the diffuse body is below a boundary (MetallicRoughnessInputs::bodyBelowBoundary).
inline bool bodyBelowBoundary(const Data& data) { return data.coatAlpha < 0; }
/// Returns the transmittance of a boundary above the body at the angles of wo and wi, relative to the mean
/// for diffuse light; the mean of (1 - cosine)^5 is 1/21. Not inlined, because other bodies would pay for it.
[[gnu::noinline]] inline float boundaryTransmittance(const Data& data, float cosO, float cosI) {
    const float mean = 1 - lerp(data.dielectricF0, data.dielectricF90, 1.f / 21);
    return dielectricTransmittance(data, cosO) * dielectricTransmittance(data, cosI) / std::max(mean, .01f);
}
/// Returns the fraction of light that passes the sheen on its way from wi to wo.
inline float sheenTransmittance(const Data& data, float cosO, float cosI) {
    const float strongest = maxComponent(Rgb(data.sheen));
    return 1 - strongest * std::max(sheenAlbedo(std::abs(cosO), data.sheenRoughness),
                                    sheenAlbedo(std::abs(cosI), data.sheenRoughness));
}
/// Whether there is a sheen.
inline bool hasSheen(const Data& data) { return maxComponent(Rgb(data.sheen)) > 0; }

/// The directions of the gloss and of the clearcoat, in frames of their own.
inline V3f turned(const Data& data, const V3f& w) {
    return {data.turnCos * w.x + data.turnSin * w.y, data.turnCos * w.y - data.turnSin * w.x, w.z};
}
inline V3f turnedBack(const Data& data, const V3f& w) {
    return {data.turnCos * w.x - data.turnSin * w.y, data.turnCos * w.y + data.turnSin * w.x, w.z};
}
inline bool hasTiltedCoat(const Data& data) { return data.coatX != 0 || data.coatY != 0; }
inline V3f coatNormal(const Data& data) {
    return {data.coatX, data.coatY, safeSqrt(1 - sqr(data.coatX) - sqr(data.coatY))};
}
/// Rotates by the shortest way from the z axis to the normal `n`, or back. n.z > 0.
inline V3f tilted(const V3f& n, const V3f& w) {
    const float k = (n.x * w.x + n.y * w.y) / (1 + n.z);
    return {w.x + n.x * w.z - n.x * k, w.y + n.y * w.z - n.y * k, n.z * w.z - (n.x * w.x + n.y * w.y)};
}
inline V3f toCoat(const Data& data, const V3f& w) {
    const V3f n = coatNormal(data);
    return hasTiltedCoat(data) ? tilted({-n.x, -n.y, n.z}, w) : w;
}
inline V3f fromCoat(const Data& data, const V3f& w) {
    return hasTiltedCoat(data) ? tilted(coatNormal(data), w) : w;
}
inline constexpr float kCoatF0 = 0.04f;
/// Returns the reflectance of the clearcoat.
inline float coatFresnel(const Data& data, float cosine) {
    return data.coat * (kCoatF0 + (1 - kCoatF0) * schlick(cosine));
}

/// The fraction of uniform light that GGX reflects is f0 scale + f90 bias: approximately, after Karis
/// ("Physically Based Shading on Mobile", 2014).
struct GlossReflectance {
    float scale, bias;

    GlossReflectance(float cosine, float alpha) {
        const float roughness = std::sqrt(alpha), r = 1 - roughness;
        const float k = std::min(sqr(r), std::exp2(-9.28f * cosine)) * r + 0.0425f - 0.0275f * roughness;
        scale = 1.04f - 0.572f * roughness - 1.04f * k;
        bias = 0.022f * roughness - 0.04f + 1.04f * k;
    }
};

/// Returns the approximate fraction of uniform light that is reflected or transmitted towards wo.
inline Rgb reflectance(const Data& data, const V3f& wo) {
    const float cosine = std::abs(wo.z);
    const GlossReflectance gloss(cosine, data.alpha);
    const Rgb body =
        (Rgb(data.diffuse) * kPi + Rgb(data.transmission)) * dielectricTransmittance(data, cosine) +
        Rgb(data.f0) * gloss.scale + Rgb(data.f90 * gloss.bias);
    if (!(data.coat > 0))
        return body;
    const float coatCosine = std::abs(toCoat(data, wo).z);
    const GlossReflectance coat(coatCosine, data.coatAlpha);
    return Rgb(data.coat * (kCoatF0 * coat.scale + coat.bias)) + body * (1 - coatFresnel(data, coatCosine));
}

/// Returns Smith's masking G1 of GGX for one direction.
inline float masking(float cosine, float alpha) {
    const float c = std::abs(cosine), a2 = sqr(alpha);
    return c > 0 ? 2 * c / (c + std::sqrt(a2 + (1 - a2) * sqr(c))) : 0;
}

/// Returns Smith's masking of the gloss.
inline float glossMasking(const Data& data, const V3f& w) {
    return data.alpha == data.alphaV ? masking(w.z, data.alpha) : ggxMasking(w, glossAlpha(data));
}

/// The probabilities of sampling the lobes, given wo: their approximate fractions of the albedo.
struct LobeProbabilities {
    float gloss, diffuse, transmission, coat;

    LobeProbabilities(const Data& data, const V3f& wo) {
        coat = coatFresnel(data, std::abs(toCoat(data, wo).z));
        gloss = (1 - coat) * luminance(fresnel(data, std::abs(wo.z)));
        // Without the transmittance: most diffuse light arrives at angles of little reflection, for any wo.
        diffuse = (1 - coat) * kPi * luminance(data.diffuse);
        if (hasSheen(data)) // sampled like diffuse light
            diffuse += (1 - coat) * luminance(data.sheen) * sheenAlbedo(std::abs(wo.z), data.sheenRoughness);
        transmission = (1 - coat) * luminance(data.transmission) *
                       std::max(dielectricTransmittance(data, std::abs(wo.z)), .1f);
        const float sum = gloss + diffuse + transmission + coat;
        const float scale = sum > 0 ? 1 / sum : 0;
        gloss *= scale;
        diffuse *= scale;
        transmission *= scale;
        coat *= scale;
    }
};

/// The lobes for one wo: all values that do not depend on wi.
struct LobesAt {
    const Data& data;
    const V3f& wo;
    const V3f glossWo, coatWo; ///< in the frames of the lobes
    LobeProbabilities probabilities;
    GgxReflection gloss, coat;

    LobesAt(const Data& d, const V3f& w)
        : data(d), wo(w), glossWo(turned(d, w)), coatWo(toCoat(d, w)), probabilities(d, w),
          gloss(glossWo, glossAlpha(d), glossAxes(d)), coat(coatWo, ggx(d.coatAlpha)) {}
    static GgxAlpha ggx(float alpha) {
        const float a = std::max(alpha, kMinAlpha); // the result is not used for mirrors
        return {a, a};
    }

    /// Writes f |cos wi| and the density per solid angle of all smooth lobes.
    void eval(const V3f& wi, Rgb& f, float& pdf) const {
        f = Rgb(0);
        pdf = 0;
        if (wo.z * wi.z > 0)
            evalReflection(wi, f, pdf);
        else if (wo.z * wi.z < 0 && data.alpha > 0 && probabilities.transmission > 0)
            evalTransmission(wi, f, pdf);
    }

  private:
    void evalReflection(const V3f& wi, Rgb& f, float& pdf) const {
        const float cosHalf = safeSqrt((1 + dot(wo, wi)) / 2); // between wo (or wi) and the half vector
        const float cosine = std::abs(wi.z);
        float transmittance = dielectricTransmittance(data, cosHalf);
        if (bodyBelowBoundary(data)) [[unlikely]]
            transmittance = boundaryTransmittance(data, std::abs(wo.z), cosine);
        f = Rgb(data.diffuse) * (transmittance * cosine);
        pdf = probabilities.diffuse * cosine * kInvPi;
        if (data.alpha > 0) {
            const V3f glossWi = turned(data, wi);
            const float density = gloss.pdf(glossWo, glossWi);
            f += fresnel(data, cosHalf) * (density * glossMasking(data, glossWi));
            pdf += probabilities.gloss * density;
        }
        if (hasSheen(data))
            addSheen(wi, f);
        if (data.coat > 0)
            addCoat(wi, cosHalf, f, pdf);
    }

    void addSheen(const V3f& wi, Rgb& f) const {
        const V3f half = wo + wi;
        const float cosine = std::abs(wi.z);
        const float cosNormal = std::abs(half.z) / std::max(length(half), 1e-7f);
        f = f * sheenTransmittance(data, wo.z, wi.z) +
            Rgb(data.sheen) * (sheenBrdf(std::abs(wo.z), cosine, cosNormal, data.sheenRoughness) * cosine);
    }

    void addCoat(const V3f& wi, float cosHalf, Rgb& f, float& pdf) const {
        const float reflected = coatFresnel(data, cosHalf);
        f *= 1 - reflected;
        const V3f coatWi = toCoat(data, wi);
        if (!(data.coatAlpha > 0) || coatWo.z * coatWi.z <= 0)
            return;
        const float density = coat.pdf(coatWo, coatWi);
        // The cosine is that of the base, so that the sum is reciprocal.
        const float cosines = hasTiltedCoat(data) ? std::abs(wi.z / coatWi.z) : 1;
        f += Rgb(reflected * density * masking(coatWi.z, data.coatAlpha) * cosines);
        pdf += probabilities.coat * density;
    }

    /// Transmission through a thin wall is the reflection lobe mirrored at the surface.
    void evalTransmission(const V3f& wi, Rgb& f, float& pdf) const {
        const V3f mirrored(wi.x, wi.y, -wi.z), glossWi = turned(data, mirrored);
        const float cosHalf = safeSqrt((1 + dot(wo, mirrored)) / 2), density = gloss.pdf(glossWo, glossWi);
        f = Rgb(data.transmission) * (dielectricTransmittance(data, cosHalf) * density *
                                      glossMasking(data, glossWi) * (1 - coatFresnel(data, cosHalf)));
        if (hasSheen(data))
            f *= sheenTransmittance(data, wo.z, wi.z);
        pdf = probabilities.transmission * density;
    }
};

} // namespace strobe::metallic_roughness
