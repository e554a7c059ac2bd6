#include "loader/build/integrator_setup.h"

#include <utility>

namespace strobe {
namespace {

/// Sets the parameters of -D options: of the integrator if it has a parameter of that name, else of the
/// shader.
void applyDefines(const std::vector<std::string>& defines, const PluginTables& tables, Statement& integrator,
                  Statement& shading) {
    const auto& integratorRow =
        findPlugin(tables.integrators, integrator.name, "integrator", integrator.where);
    const auto& shaderRow = findPlugin(tables.shaders, shading.name, "shading integrator", shading.where);
    std::vector<ParamInfo> all = integratorRow.params;
    all.insert(all.end(), shaderRow.params.begin(), shaderRow.params.end());
    for (const std::string& define : defines) {
        const Param param = parseOverride(define, all);
        const bool isOfIntegrator =
            std::any_of(integratorRow.params.begin(), integratorRow.params.end(), [&](const ParamInfo& info) {
                return info.name == param.name || info.alias == param.name;
            });
        (isOfIntegrator ? integrator : shading).params.replace(param, all);
    }
}

/// Throws if the scene's `Integrator` is neither a shader nor a sharing integrator: the parser takes every
/// name but those of sharing integrators for a shader.
void checkShader(const PluginTables& tables, const Statement& shading) {
    std::vector<std::string> names;
    std::string known;
    const auto add = [&](const std::string& name, const char* separator) {
        names.push_back(name);
        known += separator + name;
    };
    for (const auto& row : tables.integrators)
        add(row.name, known.empty() ? "" : ", ");
    const char* separator = "; for shading: ";
    for (const auto& row : tables.shaders) {
        if (row.name == shading.name)
            return;
        add(row.name, std::exchange(separator, ", "));
    }
    if (!shading.where) // of the command line, whose error the factory reports
        return;
    const std::string nearest = nearestName(shading.name, names);
    throw Error(shading.where, "unknown integrator \"" + shading.name + '"' +
                                   (nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?") +
                                   " (known: " + known + ")");
}

/// Returns the values of a parameter as text, separated by blanks.
std::string valueText(const Param& p) {
    std::string text;
    const auto append = [&](const std::string& word) { text += (text.empty() ? "" : " ") + word; };
    for (float f : p.floats)
        append(std::to_string(f));
    for (int i : p.ints)
        append(p.type == ParamType::Bool ? (i ? "true" : "false") : std::to_string(i));
    for (const std::string& s : p.strings)
        append(s);
    return text;
}

/// Adds a plugin's name and the values of all its parameters, defaults included, to the metadata.
void record(Metadata& metadata, const std::string& key, const std::string& name, const ParamSet& params,
            const std::vector<ParamInfo>& known) {
    metadata.emplace_back("strobe:" + key, name);
    for (const ParamInfo& info : known) {
        std::string value = info.fallback;
        for (const Param& p : params.all())
            if (p.name == info.name || (!info.alias.empty() && p.name == info.alias))
                value = valueText(p);
        metadata.emplace_back("strobe:" + key + ":" + info.name, value);
    }
}

const ParamDef<int> kMaxDepth{"maxdepth", 5, "of a .pbrt file"};

/// Converts the "maxdepth" of a .pbrt file to that of the shaders: pbrt's direct lighting has direct light
/// with any depth, and the path tracer of pbrt-v2 counts the segments between vertices.
void convertDepth(Statement& shading, Conventions conventions) {
    if (const auto type = shading.params.typeOf(kMaxDepth); type && *type != ParamType::Int)
        return; // an error, which the shader reports
    const bool countsBounces = conventions == Conventions::PbrtV2 && shading.name == "path";
    const int depth = shading.params.get(kMaxDepth);
    const int converted = countsBounces ? depth + 1 : std::max(depth, 1);
    if (converted != depth && (countsBounces || shading.name == "directlighting"))
        shading.params.replace({kMaxDepth.name, ParamType::Int, shading.where, {}, {converted}, {}},
                               {kMaxDepth});
}

} // namespace

Statement orDefault(std::optional<Statement>& statement, const char* name) {
    return statement ? std::move(*statement) : Statement{name, ParamSet{}, Location{}};
}

void makeIntegrators(SceneDescription& description, const BuildOptions& options, const PluginTables& tables,
                     PluginFactory& factory, FrameSetup& setup) {
    const bool v2 = description.conventions == Conventions::PbrtV2;
    Statement shading = orDefault(description.shading, v2 ? "directlighting" : "path");
    Statement integrator = orDefault(description.integrator, "supersample");
    if (!options.integrator.empty() && options.integrator != integrator.name)
        integrator = Statement{options.integrator, ParamSet{}, Location{}};
    if (!options.shading.empty() && options.shading != shading.name)
        shading = Statement{options.shading, ParamSet{}, Location{}};
    factory.resolveName(shading, "shading integrator", tables.shaders);
    checkShader(tables, shading);
    if (!description.strictParameters && shading.where)
        convertDepth(shading, description.conventions);
    applyDefines(options.defines, tables, integrator, shading);
    constexpr int kGltfTransparentDepth = 16; // panes behind panes are as bright as in viewers
    const auto& params = shading.params.all();
    const bool isSet = std::any_of(params.begin(), params.end(),
                                   [](const Param& p) { return p.name == "transparentdepth"; });
    if (!description.gltfs.empty() && !isSet)
        shading.params.add({"transparentdepth", ParamType::Int, {}, {}, {kGltfTransparentDepth}, {}});
    setup.shader = factory.make(tables.shaders, shading, "shading integrator");
    setup.integrator = factory.make(tables.integrators, integrator, "integrator");
    record(setup.metadata, "integrator", integrator.name, integrator.params,
           findPlugin(tables.integrators, integrator.name, "integrator", {}).params);
    record(setup.metadata, "shading", shading.name, shading.params,
           findPlugin(tables.shaders, shading.name, "shading integrator", {}).params);
}

} // namespace strobe
