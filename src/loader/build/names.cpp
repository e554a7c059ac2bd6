#include "loader/build/names.h"

#include "core/scene/object_names.h"
#include "loader/build/plugin_tables.h"

#include <cctype>

namespace strobe {

namespace {

void readName(ShapeDecl& decl) {
    if (decl.shape.params.has(kShapeName))
        decl.name = decl.shape.params.get(kShapeName);
}

/// Returns the name of an unnamed shape without its number: the stem of its file's name, or its plugin.
std::string baseName(const Statement& shape) {
    for (const Param& param : shape.params.all())
        if (param.name == "filename" && param.strings.size() == 1)
            return std::filesystem::path(param.strings[0]).stem().string();
    return shape.name;
}

} // namespace

void nameShapes(SceneDescription& description) {
    for (ObjectDecl& object : description.objects)
        for (ShapeDecl& shape : object.shapes)
            readName(shape);
    Numbering numbers;
    for (ShapeDecl& shape : description.world.shapes) {
        readName(shape);
        if (shape.name.empty())
            shape.name = numbers.next(baseName(shape.shape));
    }
}

int lightGroupIndex(const ParamSet& light, std::vector<std::string>& groups) {
    const std::string name = light.has(kLightGroup) ? light.get(kLightGroup) : "rest";
    const auto isAllowed = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
    if (name.empty() || !std::all_of(name.begin(), name.end(), isAllowed))
        throw Error(light.whereIs(kLightGroup),
                    "\"group\" must consist of letters, digits and underscores, not \"" + name + "\"");
    const auto index = std::find(groups.begin(), groups.end(), name) - groups.begin();
    if (size_t(index) == groups.size())
        groups.push_back(name);
    return int(index);
}

std::vector<std::string> cryptomatteNames(const std::vector<MaterialDecl>& materials) {
    std::vector<std::string> names;
    Numbering numbers;
    for (const MaterialDecl& decl : materials)
        names.push_back(!decl.name.empty() ? decl.name
                        : names.empty()    ? "default"
                                           : numbers.next(decl.material.name));
    return names;
}

} // namespace strobe
