// The tables of all plugins, and their names in other renderers.
#pragma once

#include "core/interfaces/shape.h"
#include "core/math/api.h"
#include "core/params/plugin.h"
#include "loader/build/plugin_library.h"

#include <map>
#include <string>
#include <vector>

namespace STROBE_API strobe {

/// The parameters of a Film directive.
struct FilmSetup {
    V2i resolution;
    V2f cropX{0, 1}, cropY{0, 1}; ///< crop window, in fractions of the frame
    bool hasPixelBounds = false;
    V2i boundsX, boundsY; ///< crop window, in pixels, half-open
    std::string filename;
    float scale = 1; ///< factor of all light sources
};

struct PluginTables : PluginRows {
    std::vector<Plugin<FilmSetup>> films;
};

/// Returns the tables of all plugins: those of strobe, and those of the libraries. Throws Error of kind Usage
/// if two of a kind have one name.
PluginTables pluginTables(const PluginLibraries& libraries = {});

/// Parameters of all materials.
inline const ParamDef<FloatInput> kDisplacement{
    "displacement", 0.f, "bump map: texture of the height, in units of world space", "bumpmap"};
inline const ParamDef<RgbInput> kNormalMap{
    "normalmap", Rgb(.5f, .5f, 1),
    "texture, or file name as a string, of tangent-space normals; (0.5, 0.5, 1): unperturbed"};

/// A parameter of every shape; the builder reads it.
inline const ParamDef<std::string> kShapeName{
    "name", "", "name in object ids and Cryptomatte; default: the name of the file or plugin, and a number"};

/// A parameter of every light and area light; the builder reads it.
inline const ParamDef<std::string> kLightGroup{
    "group", "rest",
    "light group: the layer of --aov lightgroups that receives the light; letters, digits and underscores"};

/// The plugin that replaces another renderer's plugin.
struct PluginAlias {
    std::string name;      ///< the plugin of strobe; empty: none, the statement is skipped
    bool isExact = false;  ///< the same plugin: unread parameters are reported
    bool isWarned = false; ///< warn that an exact alias is used; other aliases always warn
};
/// Returns the aliases of a kind ("material", "shape", …), by the other renderer's name.
const std::map<std::string, PluginAlias>& pluginAliases(const std::string& kind);

/// Returns the text of `strobe --list`: every plugin with its parameters, their defaults and descriptions.
std::string listPlugins(const PluginTables& tables);
/// As above, of the plugins called `name`, of any kind. Throws Error of kind Usage if there is none.
std::string listPlugins(const PluginTables& tables, const std::string& name);

} // namespace strobe
