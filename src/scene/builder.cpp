#include "scene/builder.h"

#include "cameras/shutter.h"
#include "scene/geometry_builder.h"

#include <cmath>

namespace strobe {

namespace {

/// The name of a plugin that is skipped; no scene can spell it.
const char* const kLeftOut = "\n";

/// Makes plugins from statements: looks the name up, creates, reports what was not read.
class Maker {
  public:
    Maker(SceneDescription& description, Messages& messages)
        : m_strict(description.strictParameters), m_context{messages, description.conventions,
                                                            description.keyTimes,
                                                            std::make_shared<TextureCache>()},
          m_textures(std::make_shared<TextureTable>()) {}

    template <class Product, class... Args>
    Product make(const std::vector<Plugin<Product, Args...>>& table, Statement& statement, const char* kind,
                 const std::type_identity_t<Args>&... args) {
        resolveName(statement, kind);
        if (statement.name == kLeftOut)
            return Product{};
        const auto& row = findPlugin(table, statement.name, kind, statement.where);
        statement.params.bindTextures(m_textures);
        Product product = row.create(statement.params, m_context, args...);
        statement.params.reportUnused(row.params, m_strict, m_context.messages);
        return product;
    }

    /// Puts our name in the place of another renderer's, saying so where it is not the same thing; kLeftOut
    /// where there is nothing like it.
    void resolveName(Statement& statement, const char* kind) {
        const auto& known = standIns(kind);
        const auto it = known.find(statement.name);
        if (it == known.end())
            return;
        const StandIn& standIn = it->second;
        const std::string what = std::string(kind) + " \"" + statement.name + "\"";
        if (!standIn.exact)
            statement.params.markAllUsed(); // another plugin's parameters: those we know will be read
        if (standIn.name.empty())
            m_context.messages.warnOnce(what, statement.where, what + " is not supported; it is left out");
        else if (!standIn.exact)
            m_context.messages.warnOnce(what, statement.where,
                                        what + " is not supported; \"" + standIn.name + "\" takes its place");
        else if (!standIn.silent)
            m_context.messages.warnOnce(what, statement.where,
                                        what + " is called \"" + standIn.name + "\" here");
        statement.name = standIn.name.empty() ? kLeftOut : standIn.name;
    }

    TextureTable& textures() { return *m_textures; }
    const BuildContext& context() const { return m_context; }

  private:
    bool m_strict;
    BuildContext m_context;
    std::shared_ptr<TextureTable> m_textures;
};

Statement orDefault(std::optional<Statement>& given, const char* name) {
    return given ? std::move(*given) : Statement{name, ParamSet{}, Location{}};
}

void applyDefines(const std::vector<std::string>& defines, const PluginTables& tables, Statement& integrator,
                  Statement& shading) {
    const auto& integratorRow =
        findPlugin(tables.integrators, integrator.name, "integrator", integrator.where);
    const auto& shaderRow = findPlugin(tables.shaders, shading.name, "shading integrator", shading.where);
    std::vector<ParamInfo> all = integratorRow.params;
    all.insert(all.end(), shaderRow.params.begin(), shaderRow.params.end());
    for (const std::string& define : defines) {
        const Param param = parseOverride(define, all);
        const bool isIntegrators =
            std::any_of(integratorRow.params.begin(), integratorRow.params.end(), [&](const ParamInfo& info) {
                return info.name == param.name || info.alias == param.name;
            });
        (isIntegrators ? integrator : shading).params.replace(param, all);
    }
}

Window windowOf(const FilmSetup& film, const BuildOptions& options, const V2i& resolution,
                const Location& filmWhere) {
    V2f x = film.cropX, y = film.cropY;
    if (options.crop) {
        x = {(*options.crop)[0], (*options.crop)[1]};
        y = {(*options.crop)[2], (*options.crop)[3]};
    }
    // pbrt's rounding: adjacent crops share no pixel and miss none.
    const auto edge = [](float fraction, int size) {
        return std::clamp(int(std::ceil(std::clamp(fraction, 0.f, 1.f) * float(size))), 0, size);
    };
    Window window{edge(x[0], resolution.x), edge(y[0], resolution.y), edge(x[1], resolution.x),
                  edge(y[1], resolution.y)};
    if (film.hasPixelBounds && !options.crop)
        window = {std::max(film.boundsX[0], 0), std::max(film.boundsY[0], 0),
                  std::min(film.boundsX[1], resolution.x), std::min(film.boundsY[1], resolution.y)};
    if (window.width() <= 0 || window.height() <= 0)
        throw options.crop ? Error("the crop window holds no pixel", ErrorKind::Usage)
                           : Error(filmWhere, "the crop window holds no pixel");
    return window;
}

std::string valueOf(const Param& p) {
    std::string text;
    const auto append = [&](const std::string& word) { text += (text.empty() ? "" : " ") + word; };
    for (float f : p.floats) {
        std::string number = std::to_string(f);
        append(number);
    }
    for (int i : p.ints)
        append(p.type == ParamType::Bool ? (i ? "true" : "false") : std::to_string(i));
    for (const std::string& s : p.strings)
        append(s);
    return text;
}

/// Records a plugin's name and every parameter, given or default.
void record(Metadata& metadata, const std::string& key, const std::string& name, const ParamSet& params,
            const std::vector<ParamInfo>& known) {
    metadata.emplace_back("strobe:" + key, name);
    for (const ParamInfo& info : known) {
        std::string value = info.fallback;
        for (const Param& p : params.all())
            if (p.name == info.name || (!info.alias.empty() && p.name == info.alias))
                value = valueOf(p);
        metadata.emplace_back("strobe:" + key + ":" + info.name, value);
    }
}

/// What people can tell a material by.
std::string materialName(const MaterialDecl& decl) {
    const std::string where = decl.material.where.toString();
    return (decl.name.empty() ? decl.material.name : decl.name) + (where.empty() ? "" : " (" + where + ")");
}

void makeTextures(SceneDescription& description, const PluginTables& tables, Maker& maker) {
    for (TextureDecl& decl : description.textures) {
        const M44f toWorld = decl.toWorld.keys().front();
        TexturePtr texture =
            maker.make(tables.textures, decl.texture, "texture", TextureArgs{decl.isFloat, toWorld});
        maker.textures().floats.push_back(texture);
        maker.textures().rgbs.push_back(texture);
    }
}

} // namespace

BuiltScene buildScene(SceneDescription&& description, const BuildOptions& options, Messages& messages) {
    const PluginTables tables = pluginTables();
    Maker maker(description, messages);
    BuiltScene built;

    const bool v2 = description.conventions == Conventions::PbrtV2;
    Statement cameraStatement = orDefault(description.camera, "perspective");
    Statement filmStatement = orDefault(description.film, "image");
    Statement samplerStatement = orDefault(description.sampler, "sobol");
    Statement filterStatement = orDefault(description.filter, "box");
    Statement shading = orDefault(description.shading, v2 ? "directlighting" : "path");
    Statement integrator = orDefault(description.integrator, "supersample");
    if (!options.integrator.empty() && options.integrator != integrator.name)
        integrator = Statement{options.integrator, ParamSet{}, Location{}};
    if (!options.shading.empty() && options.shading != shading.name)
        shading = Statement{options.shading, ParamSet{}, Location{}};

    const FilmSetup film = maker.make(tables.films, filmStatement, "film");
    built.resolution = options.resolution.value_or(film.resolution);
    if (options.quick)
        built.resolution = {std::max(1, built.resolution.x / 4), std::max(1, built.resolution.y / 4)};
    built.window = windowOf(film, options, built.resolution, filmStatement.where);
    built.filename = film.filename;

    built.sampler = maker.make(tables.samplers, samplerStatement, "sampler", options.samplesPerPixel);
    if (options.quick && options.samplesPerPixel == 0)
        built.sampler.samplesPerPixel = std::max(1, built.sampler.samplesPerPixel / 4);
    built.sampler.samplesPerPixel = built.sampler.sampler->roundCount(built.sampler.samplesPerPixel);
    built.filter = maker.make(tables.filters, filterStatement, "pixel filter");

    maker.resolveName(shading, "shading integrator");
    applyDefines(options.defines, tables, integrator, shading);
    built.shader = maker.make(tables.shaders, shading, "shading integrator");
    built.integrator = maker.make(tables.integrators, integrator, "integrator");
    record(built.metadata, "integrator", integrator.name, integrator.params,
           findPlugin(tables.integrators, integrator.name, "integrator", {}).params);
    record(built.metadata, "shading", shading.name, shading.params,
           findPlugin(tables.shaders, shading.name, "shading integrator", {}).params);
    built.metadata.emplace_back("strobe:sampler", samplerStatement.name);
    built.metadata.emplace_back("strobe:filter", filterStatement.name);

    Shutter shutter = readShutter(cameraStatement.params);
    if (options.frameTime)
        shutter = {*options.frameTime, *options.frameTime};
    const std::shared_ptr<const Camera> camera =
        maker.make(tables.cameras, cameraStatement, "camera",
                   CameraArgs{description.cameraToWorld, built.resolution, shutter});

    makeTextures(description, tables, maker);
    std::vector<std::shared_ptr<const Material>> materials;
    for (MaterialDecl& decl : description.materials) {
        built.materialNames.push_back(materialName(decl));
        materials.push_back(maker.make(tables.materials, decl.material, "material"));
    }

    std::vector<std::shared_ptr<const Light>> lights;
    for (LightDecl& decl : description.lights)
        if (auto light = maker.make(tables.lights, decl.light, "light", LightArgs{decl.toWorld, shutter}))
            lights.push_back(std::move(light));
    const MakeShape makeShape = [&](ShapeDecl& decl) {
        return maker.make(tables.shapes, decl.shape, "shape");
    };
    const MakeAreaLight makeAreaLight = [&](const AreaLightDecl& decl, const PlacedShape& shape) {
        Statement statement = decl.light;
        return std::shared_ptr<const Light>(
            maker.make(tables.areaLights, statement, "area light", AreaLightArgs{shape}));
    };
    BuiltGeometry geometry =
        buildGeometry(description, *camera, shutter, int(lights.size()), makeShape, makeAreaLight, messages);
    lights.insert(lights.end(), geometry.areaLights.begin(), geometry.areaLights.end());
    if (lights.empty())
        messages.warn({}, "the scene has no light: the picture will be black");

    built.scene = std::make_unique<const Scene>(std::move(geometry.groups), std::move(geometry.instances),
                                                std::move(materials), std::move(lights), camera, shutter);
    return built;
}

} // namespace strobe
