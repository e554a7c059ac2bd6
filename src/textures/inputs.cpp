#include "textures/inputs.h"

namespace strobe {
namespace {

const ParamDef<std::string> kMapping{"mapping", "uv", "mapping to texture coordinates: uv or planar"};
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
    : m_scale(params.get(kUScale), params.get(kVScale)), m_delta(params.get(kUDelta), params.get(kVDelta)) {
    const std::string mapping = params.get(kMapping);
    m_isPlanar = mapping == "planar";
    if (!m_isPlanar && mapping != "uv") {
        if (!context.isLenient)
            throw Error(params.whereIs(kMapping),
                        "texture mapping \"" + mapping + "\" is not supported (known: uv, planar)");
        context.diagnostics.warnOnce("mapping " + mapping, params.whereIs(kMapping),
                                     "texture mapping \"" + mapping +
                                         "\" is not supported; \"uv\" is used instead");
    }
    if (m_isPlanar) {
        m_v1 = params.get(kV1);
        m_v2 = params.get(kV2);
        if (context.conventions != Conventions::PbrtV2)
            m_fromWorld = args.toWorld.inverse();
    }
}

TexturePoint Mapping2D::at(const TextureQuery& q) const {
    if (m_isPlanar) {
        const V3f p = transformPoint(m_fromWorld, q.p);
        return {m_delta + V2f(dot(p, m_v1), dot(p, m_v2)), V2f(0), V2f(0)};
    }
    return {q.uv * m_scale + m_delta, q.duvdx * m_scale, q.duvdy * m_scale};
}

void Mapping2D::atSoA(const TextureQuerySoA& q, int begin, int end, TexturePointSoA& out) const {
    if (m_isPlanar) {
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

} // namespace strobe
