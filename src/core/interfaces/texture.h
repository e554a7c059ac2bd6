// The texture seam, and material inputs that are either a constant or a texture.
#pragma once

#include "core/math/soa.h"

#include <memory>

namespace strobe {

/// Where a texture is looked up. Footprint members are zero unless the scene's textures ask for them.
struct TextureQuery {
    V2f uv;
    V3f p;                  ///< world space
    V2f duvdx{0}, duvdy{0}; ///< the two axes of the (one pixel wide) ray footprint, in uv
    uint32_t prim = 0;      ///< triangle of a mesh
    V2f barycentrics{0};    ///< of its second and third vertex
};

/// TextureQueries side by side.
struct TextureQuerySoA {
    const V2SoA& uv;
    const V3SoA& p;
    const V2SoA &duvdx, &duvdy;
    const uint32_t* prim;
    const float *u, *v; ///< barycentrics
    TextureQuery at(int i) const {
        return {uv.at(i), p.at(i), duvdx.at(i), duvdy.at(i), prim[i], {u[i], v[i]}};
    }
};

class Texture {
  public:
    virtual ~Texture() = default;
    virtual Rgb rgb(const TextureQuery& q) const = 0;
    /// The same of queries `begin` to `end`.
    virtual void rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const;
    /// The scalar reading, for float inputs: by default the mean of the channels.
    virtual float value(const TextureQuery& q) const {
        const Rgb c = rgb(q);
        return (c.x + c.y + c.z) / 3;
    }
    /// True when duvdx and duvdy are used: the renderer computes them only then.
    virtual bool needsFootprint() const { return false; }
    /// True when the value is the same everywhere.
    virtual bool isConstant() const { return false; }
};

inline void Texture::rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const {
    for (int i = begin; i < end; ++i)
        out.set(i, rgb(q.at(i)));
}

/// A material parameter of type float or texture.
struct FloatInput {
    float constant = 0;
    std::shared_ptr<const Texture> texture;
    FloatInput(float c = 0) : constant(c) {}
    float at(const TextureQuery& q) const { return texture ? texture->value(q) : constant; }
    bool needsFootprint() const { return texture && texture->needsFootprint(); }
};

/// A material parameter of type rgb, spectrum or texture.
struct RgbInput {
    Rgb constant{0};
    std::shared_ptr<const Texture> texture;
    RgbInput(const Rgb& c = Rgb(0)) : constant(c) {}
    Rgb at(const TextureQuery& q) const { return texture ? texture->rgb(q) : constant; }
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

/// What a texture plugin's `create` gets besides its parameters.
struct TextureArgs {
    bool isFloat; ///< declared as a float texture: its inputs are floats
    M44f toWorld; ///< texture to world, for mappings by position
};

} // namespace strobe
