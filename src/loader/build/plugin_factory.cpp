#include "loader/build/plugin_factory.h"

namespace strobe {
namespace {

/// The name of statements that are skipped; no scene can contain it.
const char* const kSkipped = "\n";

/// Returns the plugin that replaces unknown plugins of a kind; empty: they are skipped.
std::string defaultPlugin(const std::string& kind) {
    static const std::map<std::string, std::string> names{
        {"material", "matte"}, {"camera", "perspective"}, {"film", "image"},
        {"sampler", "sobol"},  {"pixel filter", "box"},   {"shading integrator", "path"}};
    const auto it = names.find(kind);
    return it == names.end() ? "" : it->second;
}

std::string kindAndName(const char* kind, const Statement& statement) {
    return std::string(kind) + " \"" + statement.name + "\"";
}

std::string usedInstead(const std::string& name) {
    return name.empty() ? "it is skipped" : "\"" + name + "\" is used instead";
}

/// pbrt-v4's "spherical" camera has another default than "environment".
void setSphericalMapping(ParamSet& params) {
    const ParamDef<std::string> mapping{"mapping", "", ""};
    if (!params.has(mapping))
        params.add({mapping.name, ParamType::String, {}, {}, {}, {"equalarea"}});
}

} // namespace

PluginFactory::PluginFactory(const SceneDescription& description, std::shared_ptr<const ColorConfig> color,
                             int textureMegabytes, Diagnostics& diagnostics)
    : m_strict(description.strictParameters), m_context{diagnostics,
                                                        description.conventions,
                                                        description.keyTimes,
                                                        std::make_shared<TextureCache>(textureMegabytes),
                                                        std::move(color),
                                                        description.pbrtVersion,
                                                        !m_strict},
      m_textures(std::make_shared<TextureTable>()) {}

PluginFactory::PluginFactory(const PluginFactory& other, Diagnostics& diagnostics)
    : m_strict(other.m_strict), m_context{diagnostics,
                                          other.m_context.conventions,
                                          other.m_context.keyTimes,
                                          other.m_context.textureCache,
                                          other.m_context.colorConfig,
                                          other.m_context.pbrtVersion,
                                          other.m_context.isLenient},
      m_textures(other.m_textures) {}

void PluginFactory::warnUnsupported(const Statement& statement, const char* kind,
                                    const std::string& replacement) {
    if (replacement.empty())
        return;
    const std::string subject = kindAndName(kind, statement);
    const std::string message = subject + " is not supported; " + replacement;
    // Another sampler, and path in place of other methods for all light, change the noise only; triangles
    // look like the surface.
    if (std::string_view(kind) == "sampler" || replacement == usedInstead("path") ||
        replacement == kConvertedToTriangles)
        m_context.diagnostics.noteOnce(subject, statement.where, message);
    else
        m_context.diagnostics.warnOnce(subject, statement.where, message);
}

bool PluginFactory::isSkipped(const Statement& statement) { return statement.name == kSkipped; }

bool PluginFactory::isCompat(const Statement& statement) const {
    if (statement.name == "measured") { // pbrt-v4's have another file format
        const std::string file = statement.params.get(ParamDef<std::string>{"filename", "", ""});
        return file.ends_with(".bsdf");
    }
    if (statement.name == "sphere" || statement.name == "disk") // strobe's have no alpha
        return statement.params.has(ParamDef<FloatInput>{"alpha", 1, ""});
    return !m_strict && m_context.conventions == Conventions::PbrtV4; // strobe's are those of pbrt-v2
}

bool PluginFactory::resolveAlias(Statement& statement, const char* kind) {
    const auto& aliases = pluginAliases(kind);
    const auto it = aliases.find(statement.name);
    if (it == aliases.end())
        return false;
    const PluginAlias& alias = it->second;
    if (statement.name == "spherical")
        setSphericalMapping(statement.params);
    if (!alias.isExact) {
        statement.params.markAllUsed(); // of another plugin: none is reported as unread
        warnUnsupported(statement, kind, usedInstead(alias.name));
    } else if (alias.isWarned) {
        const std::string subject = kindAndName(kind, statement);
        m_context.diagnostics.noteOnce(subject, statement.where,
                                       subject + " is read as \"" + alias.name + "\"");
    }
    statement.name = alias.name.empty() ? kSkipped : alias.name;
    return true;
}

void PluginFactory::replaceUnknown(Statement& statement, const char* kind) {
    const std::string name = defaultPlugin(kind);
    const std::string subject = kindAndName(kind, statement);
    m_context.diagnostics.warnOnce(
        subject, statement.where,
        "unknown " + subject + "; " +
            (kind == std::string_view("texture") ? "parameters keep their defaults" : usedInstead(name)));
    statement.params.markAllUsed();
    statement.name = name.empty() ? kSkipped : name;
}

} // namespace strobe
