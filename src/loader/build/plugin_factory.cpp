#include "loader/build/plugin_factory.h"

namespace strobe {
namespace {

/// The name of a plugin that is skipped; no scene can spell it.
const char* const kLeftOut = "\n";

/// What is made of a name that nobody knows; empty: nothing.
std::string fallback(const std::string& kind) {
    static const std::map<std::string, std::string> names{
        {"material", "matte"}, {"texture", "constant"}, {"camera", "perspective"},     {"film", "image"},
        {"sampler", "sobol"},  {"pixel filter", "box"}, {"shading integrator", "path"}};
    const auto it = names.find(kind);
    return it == names.end() ? "" : it->second;
}

} // namespace

PluginFactory::PluginFactory(const SceneDescription& description, std::shared_ptr<const ColorConfig> color,
                             Diagnostics& messages)
    : m_strict(description.strictParameters), m_context{messages,
                                                        description.conventions,
                                                        description.keyTimes,
                                                        std::make_shared<TextureCache>(),
                                                        std::move(color),
                                                        !m_strict},
      m_textures(std::make_shared<TextureTable>()) {}

PluginFactory::PluginFactory(const PluginFactory& other, Diagnostics& messages)
    : m_strict(other.m_strict), m_context{messages,
                                          other.m_context.conventions,
                                          other.m_context.keyTimes,
                                          other.m_context.textureCache,
                                          other.m_context.colorConfig,
                                          other.m_context.isLenient},
      m_textures(other.m_textures) {}

void PluginFactory::note(const Statement& statement, const char* kind, const std::string& becomes) {
    const std::string what = std::string(kind) + " \"" + statement.name + "\"";
    if (!becomes.empty())
        m_context.diagnostics.warnOnce(what, statement.where, what + " is not supported; " + becomes);
}

bool PluginFactory::isLeftOut(const Statement& statement) { return statement.name == kLeftOut; }

bool PluginFactory::isCompat(const Statement& statement) const {
    if (statement.name == "measured") { // pbrt-v4's files are others
        const std::string file = statement.params.get(ParamDef<std::string>{"filename", "", ""});
        return file.ends_with(".bsdf");
    }
    return !m_strict && m_context.conventions == Conventions::PbrtV4; // pbrt-v3's; ours are v2's
}

bool PluginFactory::resolveAlias(Statement& statement, const char* kind) {
    const auto& known = pluginAliases(kind);
    const auto it = known.find(statement.name);
    if (it == known.end())
        return false;
    const PluginAlias& standIn = it->second;
    if (statement.name == "projection") // its picture becomes a cone
        for (Param& p : statement.params.all())
            if (p.name == "fov" && p.floats.size() == 1)
                p.name = "coneangle", p.floats[0] /= 2;
    if (!standIn.exact)
        statement.params.markAllUsed(); // another plugin's parameters: those we know will be read
    if (standIn.name.empty())
        note(statement, kind, "it is left out");
    else if (!standIn.exact)
        note(statement, kind, "\"" + standIn.name + "\" takes its place");
    else if (const std::string what = std::string(kind) + " \"" + statement.name + "\""; !standIn.silent)
        m_context.diagnostics.warnOnce(what, statement.where,
                                       what + " is called \"" + standIn.name + "\" here");
    statement.name = standIn.name.empty() ? kLeftOut : standIn.name;
    return true;
}

void PluginFactory::replaceUnknown(Statement& statement, const char* kind) {
    const std::string name = fallback(kind), what = std::string(kind) + " \"" + statement.name + "\"";
    m_context.diagnostics.warnOnce(
        what, statement.where,
        what + " is not known; " + (name.empty() ? "it is left out" : "\"" + name + "\" takes its place"));
    statement.params.markAllUsed();
    statement.name = name.empty() ? kLeftOut : name;
}

} // namespace strobe
