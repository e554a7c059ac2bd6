#include "loader/build/material_factory.h"

#include "loader/compat/pbrt_inputs.h"
#include "materials/mix.h"
#include "materials/normals.h"
#include "textures/imagemap.h"

namespace strobe {
namespace {

const ParamDef<RgbInput> kOpacity{"opacity", Rgb(1), "opacity"};
const ParamDef<std::string> kFirst{"namedmaterial1", "", "name of the first material"},
    kSecond{"namedmaterial2", "", "name of the second material"};
const ParamDef<std::vector<std::string>> kMaterials{"materials", {}, "names of both materials"};
const ParamDef<RgbInput> kAmount{"amount", Rgb(.5f),
                                 "weight of the first material (pbrt-v2, v3) or of the second (v4)"};

/// Returns the parameters of a "matte" that reflects nothing.
ParamSet blackMatteParams() {
    ParamSet params;
    params.add({"Kd", ParamType::Rgb, {}, {0, 0, 0}, {}, {}, false, false});
    return params;
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
        const NormalsPtr normals = normalsOf(statement);
        if (statement.name == "mix")
            return mixOf(statement);
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
        if (normals && built.material)
            built.material = withNormals(built.material, normals);
        return built;
    }

    /// Creates the stochastic mix of two materials. The amount is that of the first material in pbrt-v2 and
    /// v3, that of the second in v4.
    BuiltMaterial mixOf(const Statement& statement) {
        const ParamSet& params = statement.params;
        const auto mean = [](const Rgb& c) { return (c.x + c.y + c.z) / 3; };
        std::vector<std::string> names = params.get(kMaterials);
        const bool isV4 = names.size() == 2;
        if (!isV4)
            names = {params.get(kFirst), params.get(kSecond)};
        FloatInput amount = params.typeOf(kAmount) == ParamType::Float
                                ? FloatInput(params.get(ParamDef<float>{kAmount.name, 0, kAmount.doc}))
                                : toGray(params.get(kAmount), mean);
        if (!isV4)
            amount = mapped(amount, [](float a) { return 1 - a; });
        params.reportUnused({kMaterials, kFirst, kSecond, kAmount}, !m_factory.context().isLenient,
                            m_factory.context().diagnostics);
        const BuiltMaterial first = findByName(names[0], statement.where),
                            second = findByName(names[1], statement.where);
        BuiltMaterial built = first;
        built.isInterface = first.isInterface && second.isInterface;
        built.material = makeMix(first.material, second.material, amount, uint32_t(m_materials.size()));
        return built;
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

    /// Returns the normal or bump map of a statement; null if it has none.
    NormalsPtr normalsOf(const Statement& statement) const {
        if (statement.name == "metallicroughness" && !statement.params.has(kDisplacement))
            return nullptr; // its parameter "normalmap" is its own
        const ParamSet& params = statement.params;
        const BuildContext& context = m_factory.context();
        if (params.typeOf(kNormalMap) == ParamType::String)
            return makeNormalMap(normalImage(params, context), 1);
        if (const TexturePtr map = params.get(kNormalMap).texture)
            return makeNormalMap(map, 1);
        const FloatInput displacement = params.get(kDisplacement);
        if (!displacement.texture || displacement.texture->isConstant())
            return nullptr;
        return makeBumpMap(displacement, !context.isLenient         ? BumpTangents::Exact
                                         : context.pbrtVersion == 4 ? BumpTangents::EqualToDu
                                                                    : BumpTangents::Unit);
    }

    /// Opens the image file of a normal map (pbrt-v4).
    static TexturePtr normalImage(const ParamSet& params, const BuildContext& context) {
        const ParamDef<FilePath> file{kNormalMap.name, {}, kNormalMap.doc};
        params.get(file); // resolves the path, or throws
        ParamSet image(params.whereIs(kNormalMap));
        for (Param p : params.all())
            if (p.name == kNormalMap.name) {
                p.name = "filename";
                image.add(std::move(p));
            }
        image.add({"encoding", ParamType::String, {}, {}, {}, {"linear"}, false, false});
        return imagemapTexturePlugin().create(image, context, TextureArgs{false, M44f()});
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
