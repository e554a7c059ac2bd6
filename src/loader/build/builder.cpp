#include "loader/build/builder.h"

#include "cameras/shutter.h"
#include "core/util/nearest_name.h"
#include "core/util/resource_policy.h"
#include "loader/build/geometry_builder.h"
#include "loader/build/gltf_scene.h"
#include "loader/build/material_factory.h"
#include "loader/build/names.h"
#include "loader/build/plugin_factory.h"

#include <cmath>

namespace strobe {

namespace {

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

/// Throws where a scene names neither what shares a shade nor how one is made: its one word for both leads
/// here.
void checkIntegrator(const PluginTables& tables, const Statement& shading) {
    std::vector<std::string> names;
    std::string known;
    const auto add = [&](const std::string& name, const char* before) {
        names.push_back(name);
        known += before + name;
    };
    for (const auto& row : tables.integrators)
        add(row.name, known.empty() ? "" : ", ");
    const char* before = "; for shading: ";
    for (const auto& row : tables.shaders) {
        if (row.name == shading.name)
            return;
        add(row.name, std::exchange(before, ", "));
    }
    if (!shading.where) // not the scene's
        return;
    const std::string nearest = nearestName(shading.name, names);
    throw Error(shading.where, "unknown integrator \"" + shading.name + '"' +
                                   (nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?") +
                                   " (known: " + known + ")");
}

PixelBounds windowOf(const FilmSetup& film, const BuildOptions& options, const V2i& resolution,
                     const Location& filmWhere) {
    if (const auto& b = options.pixelBounds) {
        if (b->x0 < 0 || b->y0 < 0 || b->x1 > resolution.x || b->y1 > resolution.y)
            throw Error("--pixel-bounds: the frame has " + std::to_string(resolution.x) + "x" +
                            std::to_string(resolution.y) + " pixels",
                        ErrorKind::Usage);
        return *b;
    }
    V2f x = film.cropX, y = film.cropY;
    if (options.crop) {
        x = {(*options.crop)[0], (*options.crop)[1]};
        y = {(*options.crop)[2], (*options.crop)[3]};
    }
    // pbrt's rounding: adjacent crops share no pixel and miss none.
    // A float may be above the fraction that was written by less than the tolerance.
    const auto edge = [](float fraction, int size) {
        constexpr double kTolerance = 1e-7;
        return std::clamp(int(std::ceil((std::clamp(double(fraction), 0., 1.) - kTolerance) * size)), 0,
                          size);
    };
    PixelBounds pixelBounds{edge(x[0], resolution.x), edge(y[0], resolution.y), edge(x[1], resolution.x),
                            edge(y[1], resolution.y)};
    if (film.hasPixelBounds && !options.crop)
        pixelBounds = {std::max(film.boundsX[0], 0), std::max(film.boundsY[0], 0),
                       std::min(film.boundsX[1], resolution.x), std::min(film.boundsY[1], resolution.y)};
    if (pixelBounds.width() <= 0 || pixelBounds.height() <= 0)
        throw options.crop ? Error("the crop window holds no pixel", ErrorKind::Usage)
                           : Error(filmWhere, "the crop window holds no pixel");
    return pixelBounds;
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

std::vector<std::shared_ptr<const Material>> materialsOf(const std::vector<BuiltMaterial>& made) {
    std::vector<std::shared_ptr<const Material>> materials;
    for (const BuiltMaterial& m : made)
        materials.push_back(m.material);
    return materials;
}

/// Brightens a light by a factor.
void scaleLight(ParamSet& params, float factor) {
    for (Param& p : params.all())
        if (p.name == "scale" && (p.type == ParamType::Float || p.type == ParamType::Rgb)) {
            for (float& f : p.floats)
                f *= factor;
            return;
        }
    params.add({"scale", ParamType::Float, {}, {factor}, {}, {}, false, false});
}

/// Asks for the memory of what rays are traced against, before it is built.
void requireTracing(const BuiltGeometry& geometry, const Location& where) {
    // Bytes, while Embree 3.13 builds; measured on grids. What all moves one way takes 180 a triangle,
    // however many keys it has; what turns once, 230 with 3 keys, 1200 with 9, 4400 with 65.
    constexpr uint64_t kTriangle = 125, kKey = 60, kInstance = 500;
    uint64_t triangles = 0, keys = 0;
    for (const Group& group : geometry.groups)
        for (const Geometry& g : group.geometries)
            if (const auto& mesh = g.placed.shape.mesh) {
                triangles += mesh->triangleCount();
                keys += mesh->triangleCount() * (mesh->positions.size() - 1);
            }
    resourcePolicyOf(where).requireMemory(
        kTriangle * triangles + kKey * keys + kInstance * geometry.instances.size(),
        std::to_string(triangles) + " triangles and " + std::to_string(geometry.instances.size()) +
            " instances",
        "subdivide less, simplify meshes, or repeat them as instances", where);
}

/// A film's scale is a factor of all light.
void scaleLights(SceneDescription& description, float factor) {
    for (LightDecl& light : description.lights)
        scaleLight(light.light.params, factor);
    for (AreaLightDecl& light : description.areaLights)
        scaleLight(light.light.params, factor);
}

} // namespace

namespace {

SceneDescription withChoices(SceneDescription&& description, const BuildOptions& options) {
    for (GltfDecl& file : description.gltfs) {
        if (file.settings.animation.empty())
            file.settings.animation = options.gltfAnimation;
        if (file.settings.camera.empty())
            file.settings.camera = options.gltfCamera;
    }
    return std::move(description);
}

} // namespace

class SceneBuilder::Impl {
  public:
    Impl(SceneDescription&& description, const BuildOptions& options, Diagnostics& messages, Frames frames)
        : m_description(withChoices(std::move(description), options)), m_messages(messages),
          m_tables(pluginTables()), m_maker(m_description, options.color, messages),
          m_gltf(m_description, *m_maker.context().textureCache, messages),
          m_camera(orDefault(m_description.camera, "perspective")),
          m_shapes([this](ShapeDecl& decl, Diagnostics& told) { return makeShape(decl, told); },
                   frames == Frames::Many),
          m_lights(m_description.lights.size()) {
        makeFilm(options);
        makeIntegrators(options);
        makeSampler(options);
        if (m_gltf.givesCamera())
            m_camera = m_gltf.camera(m_setup.resolution);
        m_shutter =
            options.shutter.value_or(m_gltf.givesCamera() ? kGltfShutter : readShutter(m_camera.params));
        makeTextures();
        makeMaterials();
        for (LightDecl& decl : m_description.lights)
            decl.group = groupOf(decl.light.params, m_setup.lightGroups);
        for (AreaLightDecl& decl : m_description.areaLights)
            decl.group = groupOf(decl.light.params, m_setup.lightGroups);
        nameShapes(m_description);
        m_setup.cryptomatteMaterialNames = cryptomatteNames(m_description.materials);
    }

    const FrameSetup& setup() const { return m_setup; }
    const Shutter& shutter() const { return m_shutter; }

    BuiltScene build(const Shutter& shutter) {
        m_gltf.beginFrame(m_description, shutter);
        for (const size_t light : m_gltf.movingLights())
            m_lights[light].reset();
        const std::shared_ptr<const Camera> camera =
            m_maker.make(m_tables.cameras, m_camera, "camera",
                         CameraArgs{m_description.cameraToWorld, m_setup.resolution, shutter});
        std::vector<std::shared_ptr<const Light>> lights = makeLights(shutter);
        const MakeAreaLight makeAreaLight = [&](const AreaLightDecl& decl, const PlacedShape& shape) {
            Statement statement = decl.light;
            auto light = m_maker.make(m_tables.areaLights, statement, "area light", AreaLightArgs{shape});
            if (light)
                light->group = decl.group;
            return std::shared_ptr<const Light>(std::move(light));
        };
        BuiltGeometry geometry = buildGeometry(m_description, *camera, shutter, int(lights.size()), m_shapes,
                                               makeAreaLight, m_messages);
        requireTracing(geometry, m_description.world.where);
        lights.insert(lights.end(), geometry.areaLights.begin(), geometry.areaLights.end());
        m_gltf.endFrame(m_description);
        if (lights.empty())
            m_messages.warn({}, "the scene has no light: the picture will be black");
        return {m_setup,
                std::make_unique<const Scene>(std::move(geometry.groups), std::move(geometry.instances),
                                              materialsOf(m_materials), std::move(lights), camera, shutter)};
    }

  private:
    void makeFilm(const BuildOptions& options) {
        if (!m_description.film && m_gltf.givesCamera())
            m_description.film = m_gltf.film();
        Statement statement = orDefault(m_description.film, "image");
        const bool isRealistic = m_camera.name == "realistic";
        const float diagonal = isRealistic ? readDiagonal(statement.params) : 0;
        const FilmSetup film = m_maker.make(m_tables.films, statement, "film");
        m_setup.resolution = options.resolution.value_or(film.resolution);
        if (options.quick)
            m_setup.resolution = {std::max(1, m_setup.resolution.x / 4),
                                  std::max(1, m_setup.resolution.y / 4)};
        m_setup.pixelBounds = windowOf(film, options, m_setup.resolution, statement.where);
        m_setup.filename = film.filename;
        if (isRealistic)
            makePerspective(m_camera.params, diagonal, m_setup.resolution);
        constexpr uint64_t kPixel = 100; // bytes: its value, its sum, and what files are made from
        const PixelBounds& w = m_setup.pixelBounds;
        resourcePolicyOf(m_description.world.where)
            .requireMemory(kPixel * uint64_t(w.width()) * uint64_t(w.height()),
                           "a picture of " + std::to_string(w.width()) + "x" + std::to_string(w.height()) +
                               " pixels",
                           "lower the resolution, or render it in parts (--pixel-bounds)",
                           statement.where ? statement.where : m_description.world.where);
        if (film.scale != 1)
            scaleLights(m_description, film.scale);
    }

    void makeSampler(const BuildOptions& options) {
        Statement sampler = orDefault(m_description.sampler, "sobol");
        Statement filter = orDefault(m_description.filter, "box");
        m_setup.sampler = m_maker.make(m_tables.samplers, sampler, "sampler", options.samplesPerPixel);
        int& count = m_setup.sampler.samplesPerPixel;
        if (options.quick && options.samplesPerPixel == 0)
            count = std::max(1, count / 4);
        count = m_setup.sampler.sampler->roundCount(count);
        if (options.samplesPerPixel > 0 && count != options.samplesPerPixel)
            m_messages.warn({}, "--spp " + std::to_string(options.samplesPerPixel) + ": sampler \"" +
                                    sampler.name + "\" takes " + std::to_string(count));
        m_setup.filter = m_maker.make(m_tables.filters, filter, "pixel filter");
        m_setup.metadata.emplace_back("strobe:sampler", sampler.name);
        m_setup.metadata.emplace_back("strobe:filter", filter.name);
    }

    void makeIntegrators(const BuildOptions& options) {
        const bool v2 = m_description.conventions == Conventions::PbrtV2;
        Statement shading = orDefault(m_description.shading, v2 ? "directlighting" : "path");
        Statement integrator = orDefault(m_description.integrator, "supersample");
        if (!options.integrator.empty() && options.integrator != integrator.name)
            integrator = Statement{options.integrator, ParamSet{}, Location{}};
        if (!options.shading.empty() && options.shading != shading.name)
            shading = Statement{options.shading, ParamSet{}, Location{}};
        m_maker.resolveName(shading, "shading integrator", m_tables.shaders);
        checkIntegrator(m_tables, shading);
        applyDefines(options.defines, m_tables, integrator, shading);
        m_setup.shader = m_maker.make(m_tables.shaders, shading, "shading integrator");
        m_setup.integrator = m_maker.make(m_tables.integrators, integrator, "integrator");
        record(m_setup.metadata, "integrator", integrator.name, integrator.params,
               findPlugin(m_tables.integrators, integrator.name, "integrator", {}).params);
        record(m_setup.metadata, "shading", shading.name, shading.params,
               findPlugin(m_tables.shaders, shading.name, "shading integrator", {}).params);
    }

    void makeTextures() {
        const auto foreign = compatTextures();
        for (TextureDecl& decl : m_description.textures) {
            const M44f toWorld = decl.toWorld.keys().front();
            TexturePtr texture = decl.made ? decl.made
                                           : m_maker.make(m_tables.textures, foreign, decl.texture, "texture",
                                                          TextureArgs{decl.isFloat, toWorld});
            m_maker.textures().floats.push_back(texture);
            m_maker.textures().rgbs.push_back(texture);
        }
    }

    void makeMaterials() {
        for (MaterialDecl& decl : m_description.materials)
            m_setup.materialNames.push_back(materialName(decl));
        m_materials = strobe::makeMaterials(m_description.materials, m_tables.materials, m_maker);
    }

    Shape makeShape(ShapeDecl& decl, Diagnostics& told) const {
        if (decl.made.mesh)
            return std::move(decl.made);
        const BuiltMaterial& material = m_materials[size_t(decl.material)];
        Shape shape;
        if (!material.isNothing || decl.areaLight >= 0)
            shape = PluginFactory(m_maker, told).make(m_tables.shapes, m_foreignShapes, decl.shape, "shape");
        decl.shape.params = ParamSet(); // most of a scene's memory
        if (shape.mesh && !shape.mesh->alpha.texture && shape.mesh->alpha.constant >= 1)
            shape.mesh->alpha = material.opacity;
        return shape;
    }

    /// Those that never move are made once.
    std::vector<std::shared_ptr<const Light>> makeLights(const Shutter& shutter) {
        std::vector<std::shared_ptr<const Light>> lights;
        for (size_t i = 0; i < m_lights.size(); ++i) {
            LightDecl& decl = m_description.lights[i];
            std::optional<std::shared_ptr<const Light>>& light = m_lights[i];
            if (!light || !decl.toWorld.isStatic()) {
                auto made =
                    m_maker.make(m_tables.lights, decl.light, "light", LightArgs{decl.toWorld, shutter});
                if (made)
                    made->group = decl.group;
                light = std::move(made);
            }
            if (*light)
                lights.push_back(*light);
        }
        return lights;
    }

    SceneDescription m_description;
    Diagnostics& m_messages;
    const PluginTables m_tables;
    PluginFactory m_maker;
    GltfScene m_gltf;
    Statement m_camera;
    ShapeStore m_shapes;
    FrameSetup m_setup;
    Shutter m_shutter;
    const std::vector<CompatPlugin<ShapeRow>> m_foreignShapes = compatShapes();
    std::vector<BuiltMaterial> m_materials;                            ///< beside the declarations
    std::vector<std::optional<std::shared_ptr<const Light>>> m_lights; ///< beside the declarations
};

SceneBuilder::SceneBuilder(SceneDescription&& description, const BuildOptions& options, Diagnostics& messages,
                           Frames frames)
    : m_impl(std::make_unique<Impl>(std::move(description), options, messages, frames)) {}
SceneBuilder::~SceneBuilder() = default;
const FrameSetup& SceneBuilder::setup() const { return m_impl->setup(); }
BuiltScene SceneBuilder::build(const Shutter& shutter) { return m_impl->build(shutter); }
BuiltScene SceneBuilder::build() { return m_impl->build(m_impl->shutter()); }

BuiltScene buildScene(SceneDescription&& description, const BuildOptions& options, Diagnostics& messages) {
    return SceneBuilder(std::move(description), options, messages, SceneBuilder::Frames::One).build();
}

} // namespace strobe
