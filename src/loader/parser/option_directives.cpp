// Directives before WorldBegin, and those whose features are out of scope.
#include "loader/parser/directive_parser.h"

#include <fmt/format.h>

namespace strobe {

ParamSet DirectiveParser::readRawParameters(const Call& call) {
    return readParams(*m_lexer, call.where, m_looksLikeV4, m_isStrict ? nullptr : &m_messages);
}

ParamSet DirectiveParser::readParameters(const Call& call, const char* kind) {
    ParamSet params = readRawParameters(call);
    std::erase_if(params.all(),
                  [&](Param& param) { return param.type == ParamType::Texture && !resolveTexture(param); });
    const auto defaults = kind ? m_state.defaults->find(kind) : m_state.defaults->end();
    if (defaults == m_state.defaults->end())
        return params;
    const size_t own = params.all().size();
    for (const Param& param : defaults->second) {
        const auto begin = params.all().begin(), end = begin + own;
        if (std::none_of(begin, end, [&](const Param& p) { return p.name == param.name; }))
            params.add(param);
    }
    return params;
}

Statement DirectiveParser::readStatement(const Call& call, const char* kind) {
    std::string name = readString(call, "a name");
    return {std::move(name), readParameters(call, kind), call.where};
}

void DirectiveParser::setOnce(std::optional<Statement>& slot, Statement statement) {
    if (slot)
        m_messages.warn(slot->where,
                        fmt::format("replaced by the statement of {}", statement.where.toString()));
    slot = std::move(statement);
}

void DirectiveParser::camera(const Call& call) {
    setOnce(m_desc.camera, readStatement(call));
    // pbrt, all versions, interpolates a camera's camera-to-world; followPbrtV2 therefore leaves it alone.
    m_coordinateSystems["camera"] = m_state.transform.inverses();
    m_desc.cameraToWorld = toKeyed(m_coordinateSystems["camera"], m_desc.keyTimes);
}

void DirectiveParser::film(const Call& call) { setOnce(m_desc.film, readStatement(call)); }
void DirectiveParser::sampler(const Call& call) { setOnce(m_desc.sampler, readStatement(call)); }
void DirectiveParser::pixelFilter(const Call& call) { setOnce(m_desc.filter, readStatement(call)); }

void DirectiveParser::integrator(const Call& call) {
    Statement statement = readStatement(call);
    const bool isSharing = m_sharingNames.count(statement.name) != 0;
    if (isSharing) {
        setOnce(m_desc.integrator, std::move(statement));
    } else {
        m_looksLikeV4 |=
            call.name == "Integrator"; // a sharing integrator is ours and says nothing about pbrt
        setOnce(m_desc.shading, std::move(statement));
    }
}

void DirectiveParser::option(const Call& call) {
    const ParamSet params = readRawParameters(call);
    const ParamDef<std::string> conventions{"conventions", "", ""};
    for (const Param& param : params.all())
        if (param.name != conventions.name) {
            m_looksLikeV4 = true;
            m_messages.warn(param.where,
                            fmt::format("Option {} is not known and ignored", inQuotes(param.name)));
        }
    if (!params.has(conventions))
        return;
    const std::string value = params.get(conventions);
    if (value != "pbrt-v2" && value != "pbrt-v4")
        throw Error(params.whereIs(conventions),
                    fmt::format("unknown conventions {} (known: pbrt-v2, pbrt-v4)", inQuotes(value)));
    m_saidConventions = value == "pbrt-v2" ? Conventions::PbrtV2 : Conventions::PbrtV4;
}

void DirectiveParser::colorSpace(const Call& call) {
    const std::string name = readString(call, "a name");
    m_looksLikeV4 = true;
    if (name != "srgb")
        m_messages.warnOnce("ColorSpace", call.where,
                            fmt::format("colors of space {} are taken as sRGB's", inQuotes(name)));
}

void DirectiveParser::accelerator(const Call& call) {
    readString(call, "a name");
    readRawParameters(call);
    m_messages.warnOnce(call.name, call.where, "Accelerator is ignored: Embree builds its own");
}

void DirectiveParser::skip(const Call& call) {
    readString(call, "a name");
    readRawParameters(call);
    m_looksLikeV4 |= call.name == "MakeNamedMedium";
    skipNotice(call);
}

void DirectiveParser::skipMediumInterface(const Call& call) {
    readString(call, "the name of a medium");
    if (m_lexer->peek() == TokenKind::String)
        readString(call, "the name of a medium");
    m_looksLikeV4 = true;
    skipNotice(call);
}

void DirectiveParser::skipNotice(const Call& call) {
    const char* why = call.name == "Renderer"
                          ? "the way of rendering is chosen by Integrator and on the command line"
                          : "participating media are out of scope";
    m_messages.warnOnce(call.name, call.where, fmt::format("{} is skipped: {}", call.name, why));
}

} // namespace strobe
