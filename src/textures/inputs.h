// Inputs of textures (numbers, colors or other textures) and mappings to two dimensions.
#pragma once

#include "core/image/texture_cache.h"
#include "core/params/plugin.h"

#include <string>

namespace strobe {

/// The definition of a texture input, which has the type of the texture: float or rgb.
struct InputDef {
    ParamDef<RgbInput> color;
    ParamDef<FloatInput> scalar;
    InputDef(const char* name, float fallback, const char* doc, const char* alias = nullptr)
        : color{name, Rgb(fallback), doc, alias}, scalar{name, fallback, doc, alias} {}
};

/// An input of a texture. A float input of an rgb texture is gray, as in pbrt-v4.
class Input {
  public:
    /// Throws the located Errors of ParamSet::get.
    Input(const ParamSet& params, const TextureArgs& args, const InputDef& def);
    Rgb rgb(const TextureQuery& q) const { return m_isFloat ? Rgb(m_scalar.at(q)) : m_color.at(q); }
    /// Returns the scalar value; for a constant color the mean of its channels.
    float value(const TextureQuery& q) const;
    /// Evaluates `rgb` for the queries `begin` to `end`.
    void rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const;
    bool needsFootprint() const { return m_scalar.needsFootprint() || m_color.needsFootprint(); }
    bool isConstant() const;
    /// Returns true if both inputs are constant and equal.
    bool equals(const Input& other) const;

  private:
    bool m_isFloat;
    FloatInput m_scalar;
    RgbInput m_color;
};

/// Texture coordinates with the axes of the footprint.
struct TexturePoint {
    V2f st;
    V2f dstdx{0}, dstdy{0};
};

/// Returns the parameters of mappings for plugin tables.
std::vector<ParamInfo> mappingParams();

/// A mapping to two dimensions: "uv", "planar", "spherical" or "cylindrical". The mappings of the position
/// take the footprint to be a sphere of diameter TextureQuery::width.
class Mapping2D {
  public:
    /// Reads mapping, uscale, vscale, udelta, vdelta, v1 and v2. Throws a located Error for an unknown
    /// mapping; in a lenient file, warns and uses "uv".
    Mapping2D(const ParamSet& params, const BuildContext& context, const TextureArgs& args);
    TexturePoint at(const TextureQuery& q) const;
    /// Maps the queries `begin` to `end`.
    void atSoA(const TextureQuerySoA& q, int begin, int end, TexturePointSoA& out) const;

  private:
    enum class Kind { Uv, Planar, Spherical, Cylindrical };
    TexturePoint planar(const V3f& p, float width) const;
    static TexturePoint spherical(const V3f& p, float width);
    TexturePoint cylindrical(V3f p, float width) const;

    Kind m_kind;
    bool m_isProjected; ///< cylindrical mappings of pbrt-v2 and v3: points are projected to the unit sphere
    V2f m_scale, m_delta;
    V3f m_v1{0}, m_v2{0};
    M44f m_fromWorld;       ///< to texture space; the identity for planar mappings of pbrt-v2 and v3
    float m_widthScale = 1; ///< of the footprint, by m_fromWorld
};

/// A mapping to three dimensions: the point in texture space, and the width of the footprint there.
class Mapping3D {
  public:
    /// Files of pbrt-v2 and v3 apply the transformation of the texture to the point, as these versions do;
    /// all others apply its inverse.
    Mapping3D(const BuildContext& context, const TextureArgs& args);
    V3f point(const TextureQuery& q) const { return transformPoint(m_fromWorld, q.p); }
    float width(const TextureQuery& q) const { return q.width * m_widthScale; }

  private:
    M44f m_fromWorld;
    float m_widthScale;
};

} // namespace strobe
