#include "textures/inputs.h"

#include <map>

namespace strobe {
namespace {

const ParamDef<std::string> kMapping{"mapping", "uv",
                                     "mapping to texture coordinates: uv, planar, spherical or cylindrical"};
const ParamDef<float> kUScale{"uscale", 1.f, "scale of u"};
const ParamDef<float> kVScale{"vscale", 1.f, "scale of v"};
const ParamDef<float> kUDelta{"udelta", 0.f, "offset of u"};
const ParamDef<float> kVDelta{"vdelta", 0.f, "offset of v"};
const ParamDef<V3f> kV1{"v1", V3f(1, 0, 0), "for planar: vector whose dot product with the position is u"};
const ParamDef<V3f> kV2{"v2", V3f(0, 1, 0), "for planar: vector whose dot product with the position is v"};

/// Writes in * scale + delta for the elements `begin` to `end`.
STROBE_TARGET_CLONES void scaleAndOffset(const V2SoA& in, const V2f& scale, const V2f& delta, int begin,
                                         int end, V2SoA& out) {
    const float sx = scale.x, sy = scale.y, dx = delta.x, dy = delta.y;
    STROBE_IVDEP
    for (int i = begin; i < end; ++i) {
        out.x[i] = in.x[i] * sx + dx;
        out.y[i] = in.y[i] * sy + dy;
    }
}

/// Returns the mean scale of lengths by a transformation: the cube root of that of volumes.
float lengthScale(const M44f& m) { return std::cbrt(std::abs(determinant3(m))); }

/// Returns true if the input is a number, not a color or texture.
bool isFloatParam(const ParamSet& params, const InputDef& def) {
    for (const Param& p : params.all())
        if (p.name == def.scalar.name || (def.scalar.alias && p.name == def.scalar.alias))
            return p.type == ParamType::Float || p.type == ParamType::Int;
    return false;
}

} // namespace

Input::Input(const ParamSet& params, const TextureArgs& args, const InputDef& def)
    : m_isFloat(args.isFloat || isFloatParam(params, def)) {
    if (m_isFloat)
        m_scalar = params.get(def.scalar);
    else
        m_color = params.get(def.color);
}

float Input::value(const TextureQuery& q) const {
    if (m_isFloat)
        return m_scalar.at(q);
    if (m_color.texture)
        return m_color.texture->value(q);
    return (m_color.constant.x + m_color.constant.y + m_color.constant.z) / 3;
}

void Input::rgbSoA(const TextureQuerySoA& q, int begin, int end, RgbSoA& out) const {
    if (!m_isFloat)
        return m_color.atSoA(q, begin, end, out);
    for (int i = begin; i < end; ++i)
        out.set(i, Rgb(m_scalar.at(q.at(i))));
}

bool Input::isConstant() const {
    const TexturePtr& texture = m_isFloat ? m_scalar.texture : m_color.texture;
    return !texture || texture->isConstant();
}

bool Input::equals(const Input& other) const {
    return isConstant() && other.isConstant() && rgb({}) == other.rgb({});
}

std::vector<ParamInfo> mappingParams() { return {kMapping, kUScale, kVScale, kUDelta, kVDelta, kV1, kV2}; }

Mapping2D::Mapping2D(const ParamSet& params, const BuildContext& context, const TextureArgs& args)
    : m_isProjected(context.pbrtVersion < 4), m_scale(params.get(kUScale), params.get(kVScale)),
      m_delta(params.get(kUDelta), params.get(kVDelta)) {
    const std::map<std::string, Kind> kinds{{"uv", Kind::Uv},
                                            {"planar", Kind::Planar},
                                            {"spherical", Kind::Spherical},
                                            {"cylindrical", Kind::Cylindrical}};
    const std::string mapping = params.get(kMapping);
    const auto kind = kinds.find(mapping);
    if (kind == kinds.end()) {
        if (!context.isLenient)
            throw Error(params.whereIs(kMapping),
                        "texture mapping \"" + mapping +
                            "\" is not supported (known: uv, planar, spherical, cylindrical)");
        context.diagnostics.warnOnce("mapping " + mapping, params.whereIs(kMapping),
                                     "texture mapping \"" + mapping +
                                         "\" is not supported; \"uv\" is used instead");
    }
    m_kind = kind == kinds.end() ? Kind::Uv : kind->second;
    if (m_kind == Kind::Planar) {
        m_v1 = params.get(kV1);
        m_v2 = params.get(kV2);
    }
    if (m_kind != Kind::Planar || context.pbrtVersion == 4)
        m_fromWorld = args.toWorld.inverse();
    m_widthScale = lengthScale(m_fromWorld);
}

TexturePoint Mapping2D::at(const TextureQuery& q) const {
    if (m_kind == Kind::Uv)
        return {q.uv * m_scale + m_delta, q.duvdx * m_scale, q.duvdy * m_scale};
    const V3f p = transformPoint(m_fromWorld, q.p);
    const float width = q.width * m_widthScale;
    return m_kind == Kind::Planar      ? planar(p, width)
           : m_kind == Kind::Spherical ? spherical(p, width)
                                       : cylindrical(p, width);
}

TexturePoint Mapping2D::planar(const V3f& p, float width) const {
    return {m_delta + V2f(dot(p, m_v1), dot(p, m_v2)), V2f(width * std::sqrt(length2(m_v1)), 0),
            V2f(0, width * std::sqrt(length2(m_v2)))};
}

TexturePoint Mapping2D::spherical(const V3f& p, float width) {
    const float radius = std::sqrt(length2(p)), ring = std::sqrt(sqr(p.x) + sqr(p.y));
    if (!(radius > 0))
        return {V2f(0)};
    const float phi = std::atan2(p.y, p.x);
    return {V2f(std::acos(std::clamp(p.z / radius, -1.f, 1.f)) * kInvPi,
                (phi < 0 ? phi + 2 * kPi : phi) * (kInvPi / 2)),
            V2f(std::min(width / radius * kInvPi, 1.f), 0),
            V2f(0, std::min(width / std::max(ring, 1e-20f) * (kInvPi / 2), 1.f))};
}

TexturePoint Mapping2D::cylindrical(V3f p, float width) const {
    if (const float radius = std::sqrt(length2(p)); m_isProjected && radius > 0) {
        p *= 1 / radius;
        width /= radius;
    }
    const float ring = std::sqrt(sqr(p.x) + sqr(p.y));
    return {V2f((kPi + std::atan2(p.y, p.x)) * (kInvPi / 2), p.z),
            V2f(std::min(width / std::max(ring, 1e-20f) * (kInvPi / 2), 1.f), 0), V2f(0, width)};
}

void Mapping2D::atSoA(const TextureQuerySoA& q, int begin, int end, TexturePointSoA& out) const {
    if (m_kind != Kind::Uv) {
        for (int i = begin; i < end; ++i) {
            const TexturePoint p = at(q.at(i));
            out.uv.set(i, p.st);
            out.duvdx.set(i, p.dstdx);
            out.duvdy.set(i, p.dstdy);
        }
        return;
    }
    scaleAndOffset(q.uv, m_scale, m_delta, begin, end, out.uv);
    scaleAndOffset(q.duvdx, m_scale, V2f(0), begin, end, out.duvdx);
    scaleAndOffset(q.duvdy, m_scale, V2f(0), begin, end, out.duvdy);
}

Mapping3D::Mapping3D(const BuildContext& context, const TextureArgs& args)
    : m_fromWorld(context.pbrtVersion < 4 ? args.toWorld : args.toWorld.inverse()),
      m_widthScale(lengthScale(m_fromWorld)) {}

} // namespace strobe
