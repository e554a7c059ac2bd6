// Directives after WorldBegin: materials, textures, lights, shapes and objects.
#include "loader/parser/directive_parser.h"
#include "loader/parser/gltf_decl.h"

#include <fmt/format.h>

namespace strobe {

void DirectiveParser::reportMistake(const Location& where, const std::string& mistake,
                                    const std::string& consequence) {
    if (m_isStrict)
        throw Error(where, mistake);
    m_diagnostics.warnOnce(mistake, where, mistake + " (" + consequence + ")");
}

bool DirectiveParser::resolveTexture(Param& param) {
    const std::string& name = param.strings.at(0);
    const auto indexIn = [&](const std::map<std::string, int>& textures) {
        const auto found = textures.find(name);
        return found == textures.end() ? -1 : found->second;
    };
    param.ints = {indexIn(m_floatTextures), indexIn(m_rgbTextures)};
    if (param.ints[0] >= 0 || param.ints[1] >= 0)
        return true;
    std::vector<std::string> names = namesOf(m_floatTextures);
    for (const auto& entry : m_rgbTextures)
        names.push_back(entry.first);
    reportMistake(param.where, fmt::format("unknown texture {}{}", inQuotes(name), suggestion(name, names)),
                  "the parameter keeps its default");
    return false;
}

void DirectiveParser::attribute(const Call& call) {
    const Location where = m_lexer->here();
    const std::string target = readString(call, "shape, light, material, medium or texture");
    const std::vector<std::string> targets{"shape", "light", "material", "medium", "texture"};
    if (std::find(targets.begin(), targets.end(), target) == targets.end())
        throw Error(where, fmt::format("unknown Attribute target {}{} (known: {})", inQuotes(target),
                                       suggestion(target, targets), fmt::join(targets, ", ")));
    m_looksLikeV4 = true;
    ParamSet params = readParameters(call);
    if (target == "medium")
        return warnIgnored({"Attribute \"medium\"", call.where});
    auto defaults = std::make_shared<Defaults>(*m_state.defaults);
    std::vector<Param>& list = (*defaults)[target];
    for (Param& param : params.all()) {
        param.isDefault = true;
        std::erase_if(list, [&](const Param& p) { return p.name == param.name; });
        list.push_back(std::move(param));
    }
    m_state.defaults = std::move(defaults);
}

void DirectiveParser::reverseOrientation(const Call&) {
    m_state.reverseOrientation = !m_state.reverseOrientation;
}

void DirectiveParser::material(const Call& call) {
    m_desc.materials.push_back({"", readStatement(call, "material")});
    m_state.material = static_cast<int>(m_desc.materials.size()) - 1;
}

void DirectiveParser::makeNamedMaterial(const Call& call) {
    const Location where = m_lexer->here();
    const std::string name = readString(call, "a name");
    ParamSet params = readParameters(call, "material");
    const std::string type = params.require(ParamDef<std::string>{"type", "", ""});
    if (const auto old = m_namedMaterials.find(name); old != m_namedMaterials.end())
        m_diagnostics.warn(where, fmt::format("material {} replaces the one at {}", inQuotes(name),
                                              m_desc.materials[old->second].material.where.toString()));
    m_desc.materials.push_back({name, {type, std::move(params), call.where}});
    m_namedMaterials[name] = static_cast<int>(m_desc.materials.size()) - 1;
}

void DirectiveParser::namedMaterial(const Call& call) {
    const Location where = m_lexer->here();
    const std::string name = readString(call, "the name of a material");
    const auto found = m_namedMaterials.find(name);
    if (found == m_namedMaterials.end())
        reportMistake(
            where,
            fmt::format("unknown material {}{}", inQuotes(name), suggestion(name, namesOf(m_namedMaterials))),
            "\"matte\" is used instead");
    m_state.material = found == m_namedMaterials.end() ? 0 : found->second;
}

void DirectiveParser::texture(const Call& call) {
    const Location where = m_lexer->here();
    const std::string name = readString(call, "the texture's name");
    const Location typeWhere = m_lexer->here();
    const std::string type = readString(call, "float, rgb, color or spectrum");
    const bool isFloat = type == "float";
    if (!isFloat && type != "rgb" && type != "color" && type != "spectrum")
        throw Error(typeWhere, fmt::format("unknown texture type {} (known: float, rgb, color, spectrum)",
                                           inQuotes(type)));
    m_looksLikeV4 |= type == "rgb" || type == "spectrum";
    Statement statement = readStatement(call, "texture");
    auto& textures = isFloat ? m_floatTextures : m_rgbTextures;
    if (const auto old = textures.find(name); old != textures.end())
        m_diagnostics.warn(where, fmt::format("texture {} replaces the one at {}", inQuotes(name),
                                              m_desc.textures[old->second].texture.where.toString()));
    m_desc.textures.push_back({name, isFloat, std::move(statement), keyed(call.where)});
    textures[name] = static_cast<int>(m_desc.textures.size()) - 1;
}

void DirectiveParser::lightSource(const Call& call) {
    if (m_object >= 0)
        m_diagnostics.warn(
            call.where, "a LightSource inside ObjectBegin is not instanced; it is added to the world once");
    Statement statement = readStatement(call, "light");
    m_desc.lights.push_back({std::move(statement), keyed(call.where)});
}

void DirectiveParser::areaLightSource(const Call& call) {
    m_desc.areaLights.push_back({readStatement(call, "light")});
    m_state.areaLight = static_cast<int>(m_desc.areaLights.size()) - 1;
}

void DirectiveParser::addGltf(GltfDecl decl) {
    decl.toParent = keyed(decl.where);
    decl.object = m_object;
    m_desc.gltfs.push_back(std::move(decl));
}

void DirectiveParser::shape(const Call& call) {
    Statement statement = readStatement(call, "shape");
    if (statement.name == "gltf")
        return addGltf(readGltf(statement.params, m_isStrict, m_diagnostics));
    target().shapes.push_back({std::move(statement),
                               keyed(call.where),
                               m_state.material,
                               m_state.areaLight,
                               m_state.reverseOrientation,
                               {},
                               {},
                               false,
                               m_state.insideMedium,
                               m_state.outsideMedium});
}

void DirectiveParser::objectInstance(const Call& call) {
    const Location where = m_lexer->here();
    const std::string name = readString(call, "the name of an object");
    if (m_object >= 0 && m_desc.objects[m_object].name == name)
        throw Error(where, fmt::format("object {} contains an instance of itself", inQuotes(name)));
    const auto found = m_objects.find(name);
    if (found == m_objects.end())
        return reportMistake(
            where, fmt::format("unknown object {}{}", inQuotes(name), suggestion(name, namesOf(m_objects))),
            "its instances are skipped");
    target().instances.push_back({found->second, keyed(call.where), call.where});
}

} // namespace strobe
