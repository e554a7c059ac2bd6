#include "loader/build/material_factory.h"

#include "loader/compat/pbrt_inputs.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kOpacity{"opacity", Rgb(1), "opacity"};
const ParamDef<std::string> kFirst{"namedmaterial1", "", "name of the first material"},
    kSecond{"namedmaterial2", "", "name of the second material"};
const ParamDef<std::vector<std::string>> kMaterials{"materials", {}, "names of both materials"};
const ParamDef<RgbInput> kAmount{"amount", Rgb(.5f),
                                 "weight of the first material (pbrt-v3) or of the second (v4)"};

/// Returns the parameters of a "matte" that reflects nothing.
ParamSet blackMatteParams() {
    ParamSet params;
    params.add({"Kd", ParamType::Rgb, {}, {0, 0, 0}, {}, {}, false, false});
    return params;
}

/// Returns the weight of a mix: a color in pbrt-v3, a number in v4.
float readAmount(const ParamSet& params) {
    if (params.typeOf(kAmount) == ParamType::Float)
        return params.get(ParamDef<float>{kAmount.name, 0, kAmount.doc});
    return meanOf(params.get(kAmount));
}

bool isInterface(const std::string& name) { return name.empty() || name == "none" || name == "interface"; }

class MaterialFactory {
  public:
    MaterialFactory(std::vector<MaterialDecl>& decls, const std::vector<MaterialRow>& table,
                    PluginFactory& factory)
        : m_decls(decls), m_table(table), m_factory(factory) {}

    std::vector<BuiltMaterial> makeAll() {
        for (MaterialDecl& decl : m_decls)
            m_materials.push_back(decl.prebuilt ? BuiltMaterial{decl.prebuilt} : make(decl.material));
        return std::move(m_materials);
    }

  private:
    BuiltMaterial make(Statement& statement) {
        m_factory.bindTextures(statement);
        ignoreBumpMaps(statement);
        if (statement.name == "mix")
            return dominantOf(statement);
        BuiltMaterial built;
        if (isInterface(statement.name)) {
            built.isInterface = true;
            m_factory.warnUnsupported(statement, "material",
                                      "shapes with it are skipped unless they are area lights");
            statement = {"matte", blackMatteParams(), statement.where};
        }
        if (statement.name == "uber") {
            const RgbInput opacity = statement.params.get(kOpacity);
            built.opacity = toGray(opacity, [](const Rgb& c) { return (c.x + c.y + c.z) / 3; });
        }
        built.material = m_factory.make(m_table, m_compat, statement, "material");
        return built;
    }

    /// Returns the material of a mix that has the larger weight.
    BuiltMaterial dominantOf(const Statement& statement) {
        m_factory.warnUnsupported(statement, "material",
                                  "its material with the larger weight is used instead");
        const ParamSet& params = statement.params;
        const float amount = readAmount(params);
        std::vector<std::string> names = params.get(kMaterials);
        const bool isV4 = names.size() == 2;
        if (!isV4)
            names = {params.get(kFirst), params.get(kSecond)};
        params.markAllUsed();
        const float firstWeight = isV4 ? 1 - amount : amount;
        return findByName(names[firstWeight < .5f ? 1 : 0], statement.where);
    }

    /// Returns the latest material of that name; the default material, with a warning, if there is none.
    BuiltMaterial findByName(const std::string& name, const Location& where) {
        for (size_t i = m_materials.size(); i-- > 0;)
            if (m_decls[i].name == name && !name.empty())
                return m_materials[i];
        m_factory.context().diagnostics.warnOnce(
            "mix of " + name, where, "unknown material \"" + name + "\" in a mix; \"matte\" is used instead");
        return m_materials[0];
    }

    void ignoreBumpMaps(const Statement& statement) {
        if (!m_factory.context().isLenient || statement.name == "metallicroughness")
            return;
        for (const Param& p : statement.params.all())
            if (p.name == "bumpmap" || p.name == "displacement" || p.name == "normalmap") {
                p.used = true;
                m_factory.context().diagnostics.warnOnce(
                    "bump", p.where, "bump, displacement and normal maps are not supported and ignored");
            }
    }

    std::vector<MaterialDecl>& m_decls;
    const std::vector<MaterialRow>& m_table;
    PluginFactory& m_factory;
    const std::vector<CompatPlugin<MaterialRow>> m_compat = compatMaterials();
    std::vector<BuiltMaterial> m_materials; ///< parallel to m_decls
};

} // namespace

std::vector<BuiltMaterial> makeMaterials(std::vector<MaterialDecl>& decls,
                                         const std::vector<MaterialRow>& table, PluginFactory& factory) {
    return MaterialFactory(decls, table, factory).makeAll();
}

} // namespace strobe
