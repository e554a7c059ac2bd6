// The interface of textures, and material parameters that are either constants or textures.
#pragma once

#include "core/math/api.h"
#include "core/math/soa.h"

#include <memory>

namespace STROBE_API strobe {

/// The point of a texture evaluation. The footprint in uv is zero unless needsFootprint() of the material's
/// textures is true.
struct TextureQuery {
    V2f uv;
    V3f p;                  ///< world space
    V2f duvdx{0}, duvdy{0}; ///< axes of the ray's footprint in uv, one pixel wide
    uint32_t prim = 0;      ///< triangle of a mesh
    V2f barycentrics{0};    ///< of the second and third vertex of the triangle
    V3f n{0};               ///< geometric normal in world space, of any length and side
    float width = 0;        ///< width of the footprint in world space, perpendicular to the ray
};

/// Texture queries as a structure of arrays, of kSoAWidth elements.
struct TextureQuerySoA {
    const V2SoA& uv;
    const V3SoA& p;
    const V2SoA &duvdx, &duvdy;
    const uint32_t* prim;
    const float *u, *v; ///< barycentrics
    const V3SoA& n;
    const float* width;
    TextureQuery at(int i) const {
        return {uv.at(i), p.at(i), duvdx.at(i), duvdy.at(i), prim[i], {u[i], v[i]}, n.at(i), width[i]};
    }
};

/// Interface of textures. Textures are immutable, and all functions are thread-safe.
class Texture {
  public:
    virtual ~Texture() = default;
    /// Returns the linear RGB value.
    virtual Rgb rgb(const TextureQuery& q) const = 0;
    /// Evaluates queries begin … end-1; same results as `rgb`, to the bit. The default calls `rgb`.
    virtual void rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const;
    /// Returns the scalar value, for float parameters. The default is the mean of the channels.
    virtual float value(const TextureQuery& q) const {
        const Rgb c = rgb(q);
        return (c.x + c.y + c.z) / 3;
    }
    /// Returns whether the texture reads duvdx and duvdy, which the renderer computes only if needed.
    virtual bool needsFootprint() const { return false; }
    /// Returns whether the value is the same everywhere.
    virtual bool isConstant() const { return false; }
};

inline void Texture::rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const {
    for (int i = begin; i < end; ++i)
        out.set(i, rgb(q.at(i)));
}

/// A material parameter of type float or texture.
struct FloatInput {
    float constant = 0;                     ///< the value without a texture
    std::shared_ptr<const Texture> texture; ///< may be null
    FloatInput(float c = 0) : constant(c) {}
    float at(const TextureQuery& q) const { return texture ? texture->value(q) : constant; }
    bool needsFootprint() const { return texture && texture->needsFootprint(); }
};

/// A material parameter of type rgb, spectrum or texture.
struct RgbInput {
    Rgb constant{0};                        ///< the value without a texture
    std::shared_ptr<const Texture> texture; ///< may be null
    RgbInput(const Rgb& c = Rgb(0)) : constant(c) {}
    Rgb at(const TextureQuery& q) const { return texture ? texture->rgb(q) : constant; }
    /// Evaluates queries begin … end-1; same results as `at`, to the bit.
    void atSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const;
    bool needsFootprint() const { return texture && texture->needsFootprint(); }
};

inline void RgbInput::atSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const {
    if (texture)
        return texture->rgbSoA(q, begin, end, out);
    std::fill(out.r + begin, out.r + end, constant.x);
    std::fill(out.g + begin, out.g + end, constant.y);
    std::fill(out.b + begin, out.b + end, constant.z);
}

/// The arguments of a texture plugin's `create`, in addition to its parameters.
struct TextureArgs {
    bool isFloat; ///< declared as a float texture: its inputs are float parameters
    M44f toWorld; ///< texture space to world, for 3D mappings
};

} // namespace strobe
