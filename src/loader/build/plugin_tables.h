// The plugin tables: every name a scene file may use, in one place.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"
#include "core/render/integrator.h"
#include "core/render/shader.h"

#include <map>
#include <string>
#include <vector>

namespace strobe {

/// Where the image goes: the film directive's values.
struct FilmSetup {
    V2i resolution;
    V2f cropX{0, 1}, cropY{0, 1}; ///< fractions of the frame
    bool hasPixelBounds = false;
    V2i boundsX, boundsY; ///< pixels, half-open
    std::string filename;
    float scale = 1; ///< of all light
};

struct PluginTables {
    std::vector<Plugin<Shape>> shapes;
    std::vector<Plugin<std::shared_ptr<const Material>>> materials;
    std::vector<Plugin<TexturePtr, const TextureArgs&>> textures;
    std::vector<Plugin<std::shared_ptr<Light>, const LightArgs&>> lights;
    std::vector<Plugin<std::shared_ptr<Light>, const AreaLightArgs&>> areaLights;
    std::vector<Plugin<std::shared_ptr<const Camera>, const CameraArgs&>> cameras;
    std::vector<Plugin<SamplerSetup, int>> samplers;
    std::vector<Plugin<std::shared_ptr<const Filter>>> filters;
    std::vector<Plugin<FilmSetup>> films;
    std::vector<Plugin<std::shared_ptr<const Shader>>> shaders;
    std::vector<Plugin<std::shared_ptr<const Integrator>>> integrators;
};

PluginTables pluginTables();

/// Every shape's, read by the builder.
inline const ParamDef<std::string> kShapeName{
    "name", "", "what layers call it; default: the file's name or the kind, and a number"};

/// Every light's and area light's, likewise.
inline const ParamDef<std::string> kLightGroup{"group", "rest",
                                               "the lights that share a layer of --aov lightgroups"};

/// Another renderer's name for one of ours, or for the nearest thing we have.
struct PluginAlias {
    std::string name;   ///< ours; empty: there is nothing like it, skip it
    bool exact = false; ///< means the same: parameters are checked as ours
    bool silent = true; ///< of an exact one: not worth a word
};
/// By kind ("material", "shape", …), then by foreign name.
const std::map<std::string, PluginAlias>& pluginAliases(const std::string& kind);

/// The text of `strobe --list`: every plugin with its parameters, defaults and a line each.
std::string listPlugins(const PluginTables& tables);

} // namespace strobe
