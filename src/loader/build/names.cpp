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

/// What an unnamed shape is called, but for its number.
std::string kindOf(const Statement& shape) {
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
            shape.name = numbers.next(kindOf(shape.shape));
    }
}

int groupOf(const ParamSet& light, std::vector<std::string>& groups) {
    const std::string name = light.has(kLightGroup) ? light.get(kLightGroup) : "rest";
    const auto fits = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
    if (name.empty() || !std::all_of(name.begin(), name.end(), fits))
        throw Error(light.whereIs(kLightGroup),
                    "\"group\" names a layer: letters, digits and underscores, not \"" + name + "\"");
    const auto index = std::find(groups.begin(), groups.end(), name) - groups.begin();
    if (size_t(index) == groups.size())
        groups.push_back(name);
    return int(index);
}

std::vector<std::string> cryptomatteNames(const std::vector<MaterialDecl>& materials) {
    std::vector<std::string> mattes;
    Numbering numbers;
    for (const MaterialDecl& decl : materials)
        mattes.push_back(!decl.name.empty() ? decl.name
                         : mattes.empty()   ? "default"
                                            : numbers.next(decl.material.name));
    return mattes;
}

} // namespace strobe
