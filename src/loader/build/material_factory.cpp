#include "loader/build/material_factory.h"

#include "loader/compat/pbrt_inputs.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kOpacity{"opacity", Rgb(1), "what does not go straight through"};
const ParamDef<std::string> kFirst{"namedmaterial1", "", "one of the two"},
    kSecond{"namedmaterial2", "", "the other"};
const ParamDef<std::vector<std::string>> kMaterials{"materials", {}, "both"};
const ParamDef<RgbInput> kAmount{"amount", Rgb(.5f), "pbrt-v3: share of the first; v4: of the second"};

/// Of a "matte" that reflects nothing.
ParamSet blackParams() {
    ParamSet params;
    params.add({"Kd", ParamType::Rgb, {}, {0, 0, 0}, {}, {}, false, false});
    return params;
}

/// A color in pbrt-v3, a number in v4.
float readAmount(const ParamSet& params) {
    if (params.typeOf(kAmount) == ParamType::Float)
        return params.get(ParamDef<float>{kAmount.name, 0, kAmount.doc});
    return meanOf(params.get(kAmount));
}

bool isNothing(const std::string& name) { return name.empty() || name == "none" || name == "interface"; }

class MaterialMakers {
  public:
    MaterialMakers(std::vector<MaterialDecl>& decls, const std::vector<MaterialRow>& table,
                   PluginFactory& maker)
        : m_decls(decls), m_table(table), m_maker(maker) {}

    std::vector<BuiltMaterial> makeAll() {
        for (MaterialDecl& decl : m_decls)
            m_made.push_back(decl.made ? BuiltMaterial{decl.made} : make(decl.material));
        return std::move(m_made);
    }

  private:
    BuiltMaterial make(Statement& statement) {
        m_maker.bind(statement);
        leaveOutBumps(statement);
        if (statement.name == "mix")
            return heavier(statement);
        BuiltMaterial made;
        if (isNothing(statement.name)) {
            made.isNothing = true;
            m_maker.note(statement, "material", "its shapes are left out, unless they shine");
            statement = {"matte", blackParams(), statement.where};
        }
        if (statement.name == "uber") {
            const RgbInput opacity = statement.params.get(kOpacity);
            made.opacity = grayOf(opacity, [](const Rgb& c) { return (c.x + c.y + c.z) / 3; });
        }
        made.material = m_maker.make(m_table, m_foreign, statement, "material");
        return made;
    }

    /// A mix is the heavier of its two.
    BuiltMaterial heavier(const Statement& statement) {
        m_maker.note(statement, "material", "the heavier of its two takes its place");
        const ParamSet& params = statement.params;
        const float amount = readAmount(params);
        std::vector<std::string> names = params.get(kMaterials);
        const bool isV4 = names.size() == 2;
        if (!isV4)
            names = {params.get(kFirst), params.get(kSecond)};
        params.markAllUsed();
        const float first = isV4 ? 1 - amount : amount;
        return called(names[first < .5f ? 1 : 0], statement.where);
    }

    /// The latest that was declared by that name.
    BuiltMaterial called(const std::string& name, const Location& where) {
        for (size_t i = m_made.size(); i-- > 0;)
            if (m_decls[i].name == name && !name.empty())
                return m_made[i];
        m_maker.context().diagnostics.warnOnce("mix of " + name, where,
                                               "unknown material \"" + name + "\" in a mix: it is matte");
        return m_made[0];
    }

    void leaveOutBumps(const Statement& statement) {
        if (!m_maker.context().isLenient)
            return;
        for (const Param& p : statement.params.all())
            if (p.name == "bumpmap" || p.name == "displacement" || p.name == "normalmap") {
                if (statement.name == "metallicroughness")
                    continue;
                p.used = true;
                m_maker.context().diagnostics.warnOnce(
                    "bump", p.where,
                    "bump, displacement and normal maps are not supported: surfaces stay smooth");
            }
    }

    std::vector<MaterialDecl>& m_decls;
    const std::vector<MaterialRow>& m_table;
    PluginFactory& m_maker;
    const std::vector<CompatPlugin<MaterialRow>> m_foreign = compatMaterials();
    std::vector<BuiltMaterial> m_made;
};

} // namespace

std::vector<BuiltMaterial> makeMaterials(std::vector<MaterialDecl>& decls,
                                         const std::vector<MaterialRow>& table, PluginFactory& maker) {
    return MaterialMakers(decls, table, maker).makeAll();
}

} // namespace strobe
