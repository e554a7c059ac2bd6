// The directives of participating media, of which only absorption is modeled.
#include "loader/parser/directive_parser.h"

#include "core/params/params.h"

#include <fmt/format.h>

namespace strobe {

namespace {

const ParamDef<std::string> kType{"type", "homogeneous", "type of the medium"};
const ParamDef<Rgb> kSigmaA{"sigma_a", Rgb(.0011f, .0024f, .014f), "absorption coefficient"};
const ParamDef<Rgb> kSigmaS{"sigma_s", Rgb(2.55f, 3.21f, 3.77f), "scattering coefficient"};
const ParamDef<float> kScale{"scale", 1, "scale of both coefficients"};
const ParamDef<std::string> kPreset{"preset", "", "name of a measured medium"};
const ParamDef<Rgb> kReflectance{"reflectance", Rgb(0), "color of a thick slab"};
const ParamDef<float> kG{"g", 0, "mean cosine of the phase function"};

/// Returns a coefficient, which is not negative.
Rgb coefficient(const ParamSet& params, const ParamDef<Rgb>& def) {
    const Rgb c = params.get(def) * std::max(params.get(kScale), 0.f);
    return {std::max(c.x, 0.f), std::max(c.y, 0.f), std::max(c.z, 0.f)};
}

} // namespace

void DirectiveParser::makeNamedMedium(const Call& call) {
    const std::string name = readString(call, "a name");
    const ParamSet params(readRawParameters(call));
    const std::string type = params.get(kType);
    m_looksLikeV4 = true;
    MediumDecl medium;
    if (type != "homogeneous") {
        m_diagnostics.warnOnce("medium " + type, call.where,
                               fmt::format("media of type {} are ignored: only the absorption of "
                                           "\"homogeneous\" media is supported",
                                           inQuotes(type)));
    } else if (params.has(kPreset) || params.has(kReflectance)) {
        m_diagnostics.warnOnce(
            "medium preset", call.where,
            "media by \"preset\" or \"reflectance\" are ignored: give sigma_a and sigma_s");
    } else {
        medium.absorption = coefficient(params, kSigmaA);
        medium.scattering = coefficient(params, kSigmaS) * (1 - std::clamp(params.get(kG), -1.f, 1.f));
        if (!isBlack(medium.scattering))
            m_diagnostics.warnOnce("medium scattering", call.where,
                                   "scattering in media is not supported: glass that is filled with a dense "
                                   "medium becomes opaque, in its color; else the medium only absorbs");
        params.reportUnused({kType, kSigmaA, kSigmaS, kScale, kG}, m_isStrict, m_diagnostics);
    }
    params.markAllUsed();
    m_media[name] = int(m_desc.media.size());
    m_desc.media.push_back(medium);
}

int DirectiveParser::readMedium(const Call& call) {
    const Location where = m_lexer->here();
    const std::string name = readString(call, "the name of a medium");
    const auto found = m_media.find(name);
    if (found == m_media.end() && !name.empty())
        reportMistake(where,
                      fmt::format("unknown medium {}{}", inQuotes(name), suggestion(name, namesOf(m_media))),
                      "it is ignored");
    return found == m_media.end() ? -1 : found->second;
}

void DirectiveParser::mediumInterface(const Call& call) {
    m_looksLikeV4 = true;
    m_state.insideMedium = readMedium(call);
    m_state.outsideMedium = m_lexer->peek() == TokenKind::String ? readMedium(call) : m_state.insideMedium;
}

} // namespace strobe
