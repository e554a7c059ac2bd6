#include "loader/build/plugin_tables.h"

#include "cameras/environment.h"
#include "cameras/orthographic.h"
#include "cameras/perspective.h"
#include "filters/box.h"
#include "filters/gaussian.h"
#include "filters/mitchell.h"
#include "filters/sinc.h"
#include "filters/triangle.h"
#include "integrators/adaptive_cache.h"
#include "integrators/indirect_cache.h"
#include "integrators/msaa.h"
#include "integrators/msaa_cache.h"
#include "integrators/supersample.h"
#include "lights/diffuse_area.h"
#include "lights/distant.h"
#include "lights/goniometric.h"
#include "lights/infinite.h"
#include "lights/point.h"
#include "lights/projection.h"
#include "lights/spot.h"
#include "lights/studio.h"
#include "loader/build/film_plugin.h"
#include "loader/parser/gltf_decl.h"
#include "materials/diffuse_transmission.h"
#include "materials/glass.h"
#include "materials/matte.h"
#include "materials/measured.h"
#include "materials/metal.h"
#include "materials/metallic_roughness.h"
#include "materials/mirror.h"
#include "materials/plastic.h"
#include "samplers/aliases.h"
#include "samplers/independent.h"
#include "samplers/sobol.h"
#include "samplers/stratified.h"
#include "shading/path_shader.h"
#include "shapes/disk.h"
#include "shapes/loopsubdiv.h"
#include "shapes/plymesh.h"
#include "shapes/sphere.h"
#include "shapes/trianglemesh.h"
#include "textures/checkerboard.h"
#include "textures/constant.h"
#include "textures/directionmix.h"
#include "textures/dots.h"
#include "textures/fbm.h"
#include "textures/imagemap.h"
#include "textures/marble.h"
#include "textures/mix.h"
#include "textures/scale.h"
#include "textures/windy.h"

#include <fmt/format.h>

namespace strobe {

namespace {

/// Returns the tables of the plugins of strobe.
PluginTables ownTables() {
    PluginTables tables;
    tables.shapes = {triangleMeshPlugin(), plyMeshPlugin(), loopSubdivPlugin(),
                     spherePlugin(),       diskPlugin(),    gltfPlugin()};
    tables.materials = {mattePlugin(),    plasticPlugin(),
                        mirrorPlugin(),   glassPlugin(),
                        metalPlugin(),    diffuseTransmissionPlugin(),
                        measuredPlugin(), metallicRoughnessPlugin()};
    tables.textures = {constantTexturePlugin(),     scaleTexturePlugin(),       mixTexturePlugin(),
                       checkerboardTexturePlugin(), imagemapTexturePlugin(),    fbmTexturePlugin(),
                       wrinkledTexturePlugin(),     windyTexturePlugin(),       marbleTexturePlugin(),
                       dotsTexturePlugin(),         directionMixTexturePlugin()};
    tables.lights = {pointLightPlugin(),    spotLightPlugin(),        distantLightPlugin(),
                     infiniteLightPlugin(), goniometricLightPlugin(), projectionLightPlugin(),
                     studioLightPlugin()};
    tables.areaLights = {diffuseAreaLightPlugin()};
    tables.cameras = {perspectivePlugin(), orthographicPlugin(), environmentPlugin()};
    tables.samplers = {independentPlugin(), stratifiedPlugin(), sobolPlugin()};
    tables.filters = {boxFilterPlugin(), triangleFilterPlugin(), gaussianFilterPlugin(),
                      mitchellFilterPlugin(), sincFilterPlugin()};
    tables.films = {imageFilmPlugin()};
    tables.shaders = {directLightingPlugin(), pathPlugin()};
    tables.integrators = {supersamplePlugin(), msaaPlugin(), msaaCachePlugin(), indirectCachePlugin(),
                          adaptiveCachePlugin()};
    return tables;
}

/// Adds the rows of a library. Throws if a name is taken.
void addRows(const PluginLibrary& library, PluginTables& tables) {
    tables.forEachKind(library.rows, [&](const char* kind, auto& table, const auto& rows) {
        for (const auto& row : rows) {
            const bool isTaken = std::any_of(table.begin(), table.end(),
                                             [&](const auto& other) { return other.name == row.name; });
            if (isTaken)
                throw Error("the plugin " + library.path.string() + " adds the " + kind + " \"" + row.name +
                                "\", which exists already",
                            ErrorKind::Usage);
            table.push_back(row);
        }
    });
}

} // namespace

PluginTables pluginTables(const PluginLibraries& libraries) {
    PluginTables tables = ownTables();
    for (const PluginLibrary& library : libraries)
        addRows(library, tables);
    for (auto& shape : tables.shapes)
        shape.params.push_back(kShapeName);
    for (auto& material : tables.materials) {
        if (material.name != "metallicroughness") // has normal maps of its own, with a scale
            material.params.push_back(kNormalMap);
        material.params.push_back(kDisplacement);
    }
    for (auto& light : tables.lights)
        light.params.push_back(kLightGroup);
    for (auto& light : tables.areaLights)
        light.params.push_back(kLightGroup);
    return tables;
}

namespace {

using PluginAliases = std::map<std::string, PluginAlias>;

PluginAliases samplerPluginAliases() {
    PluginAliases map;
    for (const auto& [alias, name] : samplerAliases())
        map[alias] = {name, true, true};
    return map;
}

std::map<std::string, PluginAliases> allPluginAliases() {
    return {
        {"sampler", samplerPluginAliases()},
        {"film", {{"rgb", {"image", true}}, {"gbuffer", {"image", false}}, {"spectral", {"image", false}}}},
        {"area light", {{"area", {"diffuse", true}}}},
        {"light", {{"exinfinite", {"infinite", true}}, {"goniophotometric", {"goniometric", true}}}},
        {"pixel filter", {{"lanczossinc", {"sinc", true}}}},
        {"camera", {{"spherical", {"environment", true}}, {"realistic", {"perspective", false}}}},
        {"shape", {{"nurbs", {}}}},
        {"material", {{"diffuse", {"matte", true}}, {"dielectric", {"glass", true}}}},
        {"shading integrator",
         {{"igi", {"path", false}},
          {"photonmap", {"path", false}},
          {"exphotonmap", {"path", false}},
          {"irradiancecache", {"path", false}},
          {"ambientocclusion", {"directlighting", false}},
          {"whitted", {"directlighting", false}},
          {"dipolesubsurface", {"directlighting", false}},
          {"diffuseprt", {"directlighting", false}},
          {"glossyprt", {"directlighting", false}},
          {"useprobes", {"directlighting", false}},
          {"bdpt", {"path", false}},
          {"mlt", {"path", false}},
          {"sppm", {"path", false}},
          {"volpath", {"path", true}},
          {"simplepath", {"path", true}},
          {"lightpath", {"path", false}},
          {"simplevolpath", {"path", true}},
          {"randomwalk", {"path", false}}}},
    };
}

/// Returns the default and the range of a parameter, e.g. " [0.5; 0 to 1]"; empty if it has neither. A
/// default that the description contains, or that is an empty string, is left out.
std::string defaultAndRange(const ParamInfo& p) {
    const bool isDescribed = p.doc.find("default: ") != std::string::npos || p.fallback == "\"\"";
    const std::string fallback = isDescribed ? "" : p.fallback;
    const char* separator = fallback.empty() || p.range.empty() ? "" : "; ";
    const std::string text = fallback + separator + p.range;
    return text.empty() ? "" : " [" + text + "]";
}

/// Returns the lines of a plugin. Columns are separated by at least two blanks: tools/make-reference relies
/// on it.
template <class Row>
std::string linesOf(const Row& row) {
    std::string out = fmt::format("  {:<18}  {}\n", row.name, row.doc);
    for (const ParamInfo& p : row.params) {
        const std::string name = p.alias.empty() ? p.name : p.name + ", " + p.alias;
        out += fmt::format("      {:<16}  {:<29}  {}{}\n", p.type, name, p.doc, defaultAndRange(p));
    }
    return out;
}

/// Calls f(title, table) for each table.
template <class F>
void forEachTable(const PluginTables& tables, const F& f) {
    f("Integrator: the mapping of visibility samples to shades (--integrator)", tables.integrators);
    f("SurfaceIntegrator, Integrator: the shader, which estimates radiance (--shading)", tables.shaders);
    f("Camera", tables.cameras);
    f("Film", tables.films);
    f("Sampler", tables.samplers);
    f("PixelFilter", tables.filters);
    f("Shape", tables.shapes);
    f("Material", tables.materials);
    f("Texture", tables.textures);
    f("LightSource", tables.lights);
    f("AreaLightSource", tables.areaLights);
}

} // namespace

const std::map<std::string, PluginAlias>& pluginAliases(const std::string& kind) {
    static const std::map<std::string, PluginAliases> all = allPluginAliases();
    static const PluginAliases none;
    const auto it = all.find(kind);
    return it == all.end() ? none : it->second;
}

std::string listPlugins(const PluginTables& tables) {
    std::string out;
    forEachTable(tables, [&](const char* title, const auto& table) {
        out += std::string(title) + '\n';
        for (const auto& row : table)
            out += linesOf(row);
        out += '\n';
    });
    return out;
}

std::string listPlugins(const PluginTables& tables, const std::string& name) {
    std::string out;
    std::vector<std::string> names;
    forEachTable(tables, [&](const char* title, const auto& table) {
        for (const auto& row : table) {
            names.push_back(row.name);
            if (row.name == name)
                out += std::string(title) + '\n' + linesOf(row) + '\n';
        }
    });
    if (out.empty())
        throw Error("--list: " + unknownName("plugin", name, names), ErrorKind::Usage);
    return out;
}

} // namespace strobe
