// What textures share: inputs that are numbers, colors or other textures, and mappings to two dimensions.
#pragma once

#include "core/image/texture_cache.h"
#include "core/params/plugin.h"

#include <string>

namespace strobe {

/// An input of a texture, of the texture's own type: float or rgb.
struct InputDef {
    ParamDef<RgbInput> color;
    ParamDef<FloatInput> scalar;
    InputDef(const char* name, float fallback, const char* doc, const char* alias = nullptr)
        : color{name, Rgb(fallback), doc, alias}, scalar{name, fallback, doc, alias} {}
};

/// The value of such an input. A float given to an rgb texture is gray, as in pbrt-v4.
class Input {
  public:
    /// Throws a located Error as ParamSet::get does.
    Input(const ParamSet& params, const TextureArgs& args, const InputDef& def);
    Rgb rgb(const TextureQuery& q) const { return m_isFloat ? Rgb(m_scalar.at(q)) : m_color.at(q); }
    float value(const TextureQuery& q) const;
    /// `rgb` of queries `begin` to `end`.
    void rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const;
    bool needsFootprint() const { return m_scalar.needsFootprint() || m_color.needsFootprint(); }
    bool isConstant() const;
    /// True when both are known to be the same everywhere.
    bool equals(const Input& other) const;

  private:
    bool m_isFloat;
    FloatInput m_scalar;
    RgbInput m_color;
};

/// A point of a two-dimensional texture with the axes of its footprint.
struct TexturePoint {
    V2f st;
    V2f dstdx{0}, dstdy{0};
};

/// The parameters of mappings, for plugins' tables.
std::vector<ParamInfo> mappingParams();

/// "uv" or "planar". A planar mapping has no footprint (a TextureQuery does not know that of its position):
/// its textures are sampled at points.
class Mapping2D {
  public:
    /// Reads mapping, uscale, vscale, udelta, vdelta, v1 and v2. Throws a located Error for another mapping.
    Mapping2D(const ParamSet& params, const BuildContext& context, const TextureArgs& args);
    TexturePoint at(const TextureQuery& q) const;
    /// The same of queries `begin` to `end`.
    void atSoA(const TextureQuerySoA& q, int begin, int end, TexturePointSoA& out) const;
    bool hasFootprint() const { return !m_planar; }

  private:
    bool m_planar;
    V2f m_scale, m_delta;
    V3f m_v1{0}, m_v2{0};
    M44f m_fromWorld; ///< planar: pbrt-v2 maps positions of the world, v3 and v4 of the texture's space
};

} // namespace strobe
