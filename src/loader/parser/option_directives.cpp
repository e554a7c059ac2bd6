// Directives before WorldBegin, and directives of unsupported features.
#include "loader/parser/directive_parser.h"

#include <fmt/format.h>

namespace strobe {

ParamSet DirectiveParser::readRawParameters(const Call& call) {
    Diagnostics* const diagnostics = m_isStrict ? nullptr : &m_diagnostics;
    ParamSet params = readParams(*m_lexer, call.where, m_looksLikeV4, diagnostics);
    // As in pbrt, the parameters of the last directive of an included file may continue in the file that
    // includes it.
    const Lexer* reached = m_lexer;
    for (auto outer = m_outerLexers.rbegin(); outer != m_outerLexers.rend(); ++outer) {
        if (Lexer(*reached).peek() != TokenKind::End)
            break;
        const ParamSet more = readParams(**outer, call.where, m_looksLikeV4, diagnostics);
        for (const Param& param : more.all())
            params.add(param);
        reached = *outer;
    }
    return params;
}

ParamSet DirectiveParser::readParameters(const Call& call, const char* target) {
    ParamSet params = readRawParameters(call);
    std::erase_if(params.all(),
                  [&](Param& param) { return param.type == ParamType::Texture && !resolveTexture(param); });
    const auto defaults = target ? m_state.defaults->find(target) : m_state.defaults->end();
    if (defaults == m_state.defaults->end())
        return params;
    const size_t ownCount = params.all().size();
    for (const Param& param : defaults->second) {
        const auto begin = params.all().begin();
        if (std::none_of(begin, begin + ownCount, [&](const Param& p) { return p.name == param.name; }))
            params.add(param);
    }
    return params;
}

Statement DirectiveParser::readStatement(const Call& call, const char* target) {
    std::string name = readString(call, "a name");
    return {std::move(name), readParameters(call, target), call.where};
}

void DirectiveParser::setOnce(std::optional<Statement>& slot, Statement statement) {
    if (slot)
        m_diagnostics.note(slot->where,
                           fmt::format("overridden by the statement at {}", statement.where.toString()));
    slot = std::move(statement);
}

void DirectiveParser::camera(const Call& call) {
    setOnce(m_desc.camera, readStatement(call));
    // All versions of pbrt interpolate camera-to-world: see interpolateWorldToObject.
    requireTransform();
    m_coordinateSystems["camera"] = m_state.transform.inverses();
    m_desc.cameraToWorld = toKeyed(m_coordinateSystems["camera"], m_desc.keyTimes);
}

void DirectiveParser::film(const Call& call) { setOnce(m_desc.film, readStatement(call)); }
void DirectiveParser::sampler(const Call& call) {
    setOnce(m_desc.sampler, readStatement(call));
    m_looksLikeV2 |= m_desc.sampler->name == "bestcandidate" || m_desc.sampler->name == "adaptive";
}
void DirectiveParser::pixelFilter(const Call& call) { setOnce(m_desc.filter, readStatement(call)); }

void DirectiveParser::integrator(const Call& call) {
    Statement statement = readStatement(call);
    const bool isSharing = m_sharingNames.count(statement.name) != 0;
    m_looksLikeV2 |= call.name == "SurfaceIntegrator";
    if (isSharing) {
        setOnce(m_desc.integrator, std::move(statement));
    } else {
        // The names of sharing integrators are strobe's own, and do not indicate a version of pbrt.
        m_looksLikeV4 |= call.name == "Integrator";
        setOnce(m_desc.shading, std::move(statement));
    }
}

void DirectiveParser::option(const Call& call) {
    const ParamSet params = readRawParameters(call);
    const ParamDef<std::string> conventions{"conventions", "", ""};
    for (const Param& param : params.all())
        if (param.name != conventions.name) {
            m_looksLikeV4 = true;
            m_diagnostics.warn(param.where,
                               fmt::format("unknown Option {} is ignored", inQuotes(param.name)));
        }
    if (!params.has(conventions))
        return;
    const std::string value = params.get(conventions);
    if (value != "pbrt-v2" && value != "pbrt-v4")
        throw Error(params.whereIs(conventions),
                    fmt::format("unknown conventions {} (known: pbrt-v2, pbrt-v4)", inQuotes(value)));
    m_requestedConventions = value == "pbrt-v2" ? Conventions::PbrtV2 : Conventions::PbrtV4;
}

void DirectiveParser::defaultValue(const Call& call) {
    const std::string name = readString(call, "a name");
    if (m_lexer->peek() == TokenKind::Number)
        m_values.setDefault(name, std::string(m_lexer->next().text));
    else
        m_values.setDefault(name, readString(call, "a value"));
}

void DirectiveParser::colorSpace(const Call& call) {
    const std::string name = readString(call, "a name");
    m_looksLikeV4 = true;
    if (name != "srgb")
        m_diagnostics.warnOnce(
            "ColorSpace", call.where,
            fmt::format("unknown color space {}; colors are read as sRGB", inQuotes(name)));
}

void DirectiveParser::accelerator(const Call& call) {
    readString(call, "a name");
    readRawParameters(call);
    m_diagnostics.noteOnce(call.name, call.where,
                           "Accelerator is ignored: Embree builds the acceleration structure");
}

void DirectiveParser::ignore(const Call& call) {
    readString(call, "a name");
    readRawParameters(call);
    m_looksLikeV2 = true; // Renderer, VolumeIntegrator and Volume
    warnIgnored(call);
}

void DirectiveParser::warnIgnored(const Call& call) {
    const char* reason = call.name == "Renderer" ? "use Integrator or the command line"
                                                 : "participating media are not supported";
    m_diagnostics.warnOnce(call.name, call.where, fmt::format("{} is ignored: {}", call.name, reason));
}

} // namespace strobe
