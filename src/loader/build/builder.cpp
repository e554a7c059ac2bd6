#include "loader/build/builder.h"

#include "cameras/shutter.h"
#include "core/util/resource_policy.h"
#include "loader/build/deformation_fit.h"
#include "loader/build/geometry_builder.h"
#include "loader/build/gltf_scene.h"
#include "loader/build/integrator_setup.h"
#include "loader/build/material_factory.h"
#include "loader/build/names.h"
#include "loader/build/plugin_factory.h"

#include <cmath>

namespace strobe {

namespace {

/// Returns the pixels to render: those of --pixel-bounds, --crop, or the film. Throws if there are none.
PixelBounds requestedBounds(const FilmSetup& film, const BuildOptions& options, const V2i& resolution,
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
    // As in pbrt, fractions are rounded up, so that adjacent crops neither overlap nor leave a gap. The
    // tolerance exceeds the rounding error of a fraction in single precision.
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
        throw options.crop ? Error("the crop window contains no pixels", ErrorKind::Usage)
                           : Error(filmWhere, "the crop window contains no pixels");
    return pixelBounds;
}

/// Returns the name, or the plugin, of a material and its location.
std::string materialName(const MaterialDecl& decl) {
    const std::string where = decl.material.where.toString();
    return (decl.name.empty() ? decl.material.name : decl.name) + (where.empty() ? "" : " (" + where + ")");
}

std::vector<std::shared_ptr<const Material>> materialsOf(const std::vector<BuiltMaterial>& built) {
    std::vector<std::shared_ptr<const Material>> materials;
    for (const BuiltMaterial& m : built)
        materials.push_back(m.material);
    return materials;
}

/// Multiplies the "scale" parameter of a light.
void scaleLight(ParamSet& params, float factor) {
    for (Param& p : params.all())
        if (p.name == "scale" && (p.type == ParamType::Float || p.type == ParamType::Rgb)) {
            for (float& f : p.floats)
                f *= factor;
            return;
        }
    params.add({"scale", ParamType::Float, {}, {factor}, {}, {}, false, false});
}

/// Throws an Error at `where` if Embree's acceleration structures would exceed the memory limit.
void requireTracerMemory(const BuiltGeometry& geometry, const Location& where) {
    // Bytes at the peak of Embree 3.13's build, measured on grids. A mesh that translates takes 180 per
    // triangle with any number of keys; one that rotates once takes 230 with 3 keys, 1200 with 9, and 4400
    // with 65.
    constexpr uint64_t kBytesPerTriangle = 125;
    constexpr uint64_t kBytesPerKey = 60;
    constexpr uint64_t kBytesPerInstance = 500;
    uint64_t triangles = 0;
    uint64_t keys = 0;
    for (const Group& group : geometry.groups)
        for (const Geometry& g : group.geometries)
            if (const auto& mesh = g.placed.shape.mesh) {
                triangles += mesh->triangleCount();
                keys += mesh->triangleCount() * (mesh->positions.size() - 1);
            }
    const size_t instances = geometry.instances.size();
    resourcePolicyOf(where).requireMemory(
        kBytesPerTriangle * triangles + kBytesPerKey * keys + kBytesPerInstance * instances,
        std::to_string(triangles) + " triangles and " + std::to_string(instances) + " instances",
        "subdivide less, simplify meshes, or repeat them as instances", where);
}

/// Multiplies all light sources by the film's scale.
void scaleLights(SceneDescription& description, float factor) {
    for (LightDecl& light : description.lights)
        scaleLight(light.light.params, factor);
    for (AreaLightDecl& light : description.areaLights)
        scaleLight(light.light.params, factor);
}

/// Returns the description with the command line's animation and camera for glTF files that name none.
SceneDescription withGltfOptions(SceneDescription&& description, const BuildOptions& options) {
    for (GltfDecl& file : description.gltfs) {
        if (file.settings.animation.empty())
            file.settings.animation = options.gltfAnimation;
        if (file.settings.camera.empty())
            file.settings.camera = options.gltfCamera;
        file.settings.photometric &= options.gltfPhotometric;
        file.settings.culling |= options.gltfCulling;
        if (file.settings.pointRadius == 0)
            file.settings.pointRadius = options.gltfPointRadius;
    }
    return std::move(description);
}

} // namespace

class SceneBuilder::Impl {
  public:
    Impl(SceneDescription&& description, const BuildOptions& options, Diagnostics& diagnostics, Frames frames)
        : m_description(withGltfOptions(std::move(description), options)), m_diagnostics(diagnostics),
          m_tables(pluginTables(*options.plugins)),
          m_factory(m_description, options.color, options.textureMegabytes, diagnostics),
          m_gltf(m_description, *m_factory.context().textureCache, options.gltfGround, diagnostics),
          m_camera(orDefault(m_description.camera, "perspective")),
          m_shapes([this](ShapeDecl& decl, Diagnostics& recorder) { return makeShape(decl, recorder); },
                   frames == Frames::Many),
          m_lights(m_description.lights.size()), m_isTransparent(options.transparent) {
        m_setup.isLitByGltf = m_gltf.isLitByFiles();
        m_setup.textures = m_factory.context().textureCache;
        makeFilm(options);
        makeIntegrators(m_description, options, m_tables, m_factory, m_setup);
        makeSampler(options);
        if (m_gltf.givesCamera())
            m_camera = m_gltf.camera(m_setup.resolution);
        m_shutter =
            options.shutter.value_or(m_gltf.givesCamera() ? kGltfShutter : readShutter(m_camera.params));
        makeTextures();
        makeMaterials();
        for (LightDecl& decl : m_description.lights)
            decl.group = lightGroupIndex(decl.light.params, m_setup.lightGroups);
        for (AreaLightDecl& decl : m_description.areaLights)
            decl.group = lightGroupIndex(decl.light.params, m_setup.lightGroups);
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
            m_factory.make(m_tables.cameras, m_camera, "camera",
                           CameraArgs{m_description.cameraToWorld, m_setup.resolution, shutter});
        std::vector<std::shared_ptr<const Light>> lights = makeLights(shutter);
        const MakeAreaLight makeAreaLight = [&](const AreaLightDecl& decl, const PlacedShape& shape) {
            Statement statement = decl.light;
            auto light = m_factory.make(m_tables.areaLights, statement, "area light", AreaLightArgs{shape});
            if (light)
                light->group = decl.group;
            return std::shared_ptr<const Light>(std::move(light));
        };
        BuiltGeometry geometry = buildGeometry(m_description, *camera, shutter, int(lights.size()), m_shapes,
                                               makeAreaLight, m_diagnostics);
        requireTracerMemory(geometry, m_description.world.where);
        lights.insert(lights.end(), geometry.areaLights.begin(), geometry.areaLights.end());
        m_gltf.endFrame(m_description);
        if (lights.empty())
            m_diagnostics.warn({}, "the scene has no lights; the image will be black");
        return {m_setup, std::make_unique<const Scene>(
                             std::move(geometry.groups), std::move(geometry.instances),
                             materialsOf(m_materials), std::move(lights), camera, shutter, !m_isTransparent)};
    }

  private:
    void makeFilm(const BuildOptions& options) {
        if (!m_description.film && m_gltf.givesCamera())
            m_description.film = m_gltf.film();
        Statement statement = orDefault(m_description.film, "image");
        const bool isRealistic = m_camera.name == "realistic";
        const float diagonal = isRealistic ? readDiagonal(statement.params) : 0;
        const FilmSetup film = m_factory.make(m_tables.films, statement, "film");
        m_setup.resolution = options.resolution.value_or(film.resolution);
        if (options.quick)
            m_setup.resolution = {std::max(1, m_setup.resolution.x / 4),
                                  std::max(1, m_setup.resolution.y / 4)};
        m_setup.pixelBounds = requestedBounds(film, options, m_setup.resolution, statement.where);
        m_setup.filename = film.filename;
        if (isRealistic)
            makePerspective(m_camera.params, diagonal, m_setup.resolution);
        const Location scene = statement.where ? statement.where : m_description.world.where;
        requireFilmMemory(options.resolution ? Location() : scene);
        if (film.scale != 1)
            scaleLights(m_description, film.scale);
    }

    void requireFilmMemory(const Location& where) const {
        constexpr uint64_t kBytesPerPixel = 100; // its value, its sums and the buffers of output files
        const auto width = uint64_t(m_setup.pixelBounds.width());
        const auto height = uint64_t(m_setup.pixelBounds.height());
        resourcePolicyOf(m_description.world.where)
            .requireMemory(kBytesPerPixel * width * height,
                           "a picture of " + std::to_string(width) + "x" + std::to_string(height) + " pixels",
                           "lower the resolution, or render it in parts (--pixel-bounds)", where);
    }

    void makeSampler(const BuildOptions& options) {
        Statement sampler = orDefault(m_description.sampler, "sobol");
        Statement filter = orDefault(m_description.filter, "box");
        m_setup.sampler = m_factory.make(m_tables.samplers, sampler, "sampler", options.samplesPerPixel);
        int& count = m_setup.sampler.samplesPerPixel;
        if (options.quick && options.samplesPerPixel == 0)
            count = std::max(1, count / 4);
        count = m_setup.sampler.sampler->roundCount(count);
        if (options.samplesPerPixel > 0 && count != options.samplesPerPixel)
            m_diagnostics.note({}, "--spp " + std::to_string(options.samplesPerPixel) + ": sampler \"" +
                                       sampler.name + "\" takes " + std::to_string(count));
        m_setup.filter = m_factory.make(m_tables.filters, filter, "pixel filter");
        m_setup.metadata.emplace_back("strobe:sampler", sampler.name);
        m_setup.metadata.emplace_back("strobe:filter", filter.name);
    }

    void makeTextures() {
        const auto compat = compatTextures();
        for (TextureDecl& decl : m_description.textures) {
            const M44f toWorld = decl.toWorld.keys().front();
            TexturePtr texture = decl.prebuilt
                                     ? decl.prebuilt
                                     : m_factory.make(m_tables.textures, compat, decl.texture, "texture",
                                                      TextureArgs{decl.isFloat, toWorld});
            m_factory.textures().floats.push_back(texture);
            m_factory.textures().rgbs.push_back(texture);
        }
    }

    void makeMaterials() {
        for (const MediumDecl& medium : m_description.media) {
            m_denseMaterials.push_back(isBlack(medium.scattering) ? -1 : int(m_description.materials.size()));
            if (!isBlack(medium.scattering))
                m_description.materials.push_back({"dense medium",
                                                   {"metallicroughness", ParamSet(), {}},
                                                   makeDenseMedium(medium.absorption, medium.scattering)});
        }
        for (MaterialDecl& decl : m_description.materials)
            m_setup.materialNames.push_back(materialName(decl));
        m_materials = strobe::makeMaterials(m_description.materials, m_tables.materials, m_factory);
    }

    /// Called by several threads; `diagnostics` belongs to the calling thread.
    Shape makeShape(ShapeDecl& decl, Diagnostics& diagnostics) const {
        if (decl.prebuilt.mesh)
            return std::move(decl.prebuilt);
        const BuiltMaterial& material = m_materials[size_t(decl.material)];
        Shape shape;
        if (!material.isInterface || decl.areaLight >= 0)
            shape = PluginFactory(m_factory, diagnostics)
                        .make(m_tables.shapes, m_compatShapes, decl.shape, "shape");
        decl.shape.params = ParamSet(); // releases most of the description's memory
        if (shape.mesh && shape.mesh->isOpaque())
            shape.mesh->alpha = material.opacity;
        if (isFilledDensely(decl, shape))
            decl.material = m_denseMaterials[size_t(decl.insideMedium)];
        return shape;
    }

    /// Returns whether a shape of glass contains a medium through which little light passes unscattered.
    bool isFilledDensely(const ShapeDecl& decl, const Shape& shape) const {
        constexpr float kDense = 4; // optical depth along the diameter
        if (decl.insideMedium < 0 || m_denseMaterials[size_t(decl.insideMedium)] < 0 ||
            !(shape.mesh || shape.quadric) ||
            !m_materials[size_t(decl.material)].material->flags().transmissive)
            return false;
        const Box3f box = shape.mesh ? meshBounds(*shape.mesh) : shape.quadric->bounds();
        const float scale = std::cbrt(std::abs(determinant3(decl.toParent.keys().front())));
        const Rgb& scattering = m_description.media[size_t(decl.insideMedium)].scattering;
        return length(box.size()) * scale * maxComponent(scattering) > kDense;
    }

    /// Returns the lights of a frame. Static lights are created once.
    std::vector<std::shared_ptr<const Light>> makeLights(const Shutter& shutter) {
        std::vector<std::shared_ptr<const Light>> lights;
        for (size_t i = 0; i < m_lights.size(); ++i) {
            LightDecl& decl = m_description.lights[i];
            std::optional<std::shared_ptr<const Light>>& light = m_lights[i];
            if (!light || !decl.toWorld.isStatic()) {
                auto created =
                    m_factory.make(m_tables.lights, decl.light, "light", LightArgs{decl.toWorld, shutter});
                if (created)
                    created->group = decl.group;
                light = std::move(created);
            }
            if (*light)
                lights.push_back(*light);
        }
        return lights;
    }

    SceneDescription m_description;
    Diagnostics& m_diagnostics;
    const PluginTables m_tables;
    PluginFactory m_factory;
    GltfScene m_gltf;
    Statement m_camera;
    ShapeStore m_shapes;
    FrameSetup m_setup;
    Shutter m_shutter;
    const std::vector<CompatPlugin<ShapeRow>> m_compatShapes = compatShapes();
    std::vector<BuiltMaterial> m_materials; ///< by declaration
    std::vector<int> m_denseMaterials;      ///< by medium: index into m_materials, or -1
    std::vector<std::optional<std::shared_ptr<const Light>>>
        m_lights; ///< by declaration; empty: to be created
    const bool m_isTransparent;
};

SceneBuilder::SceneBuilder(SceneDescription&& description, const BuildOptions& options,
                           Diagnostics& diagnostics, Frames frames)
    : m_impl(std::make_unique<Impl>(std::move(description), options, diagnostics, frames)) {}
SceneBuilder::~SceneBuilder() = default;
const FrameSetup& SceneBuilder::setup() const { return m_impl->setup(); }
BuiltScene SceneBuilder::build(const Shutter& shutter) { return m_impl->build(shutter); }
BuiltScene SceneBuilder::build() { return m_impl->build(m_impl->shutter()); }

BuiltScene buildScene(SceneDescription&& description, const BuildOptions& options, Diagnostics& diagnostics) {
    return SceneBuilder(std::move(description), options, diagnostics, SceneBuilder::Frames::One).build();
}

} // namespace strobe
