// Libraries of plugins: --plugin and $STROBE_PLUGIN_PATH.
#pragma once

#include "loader/build/plugin_library.h"

#include <CLI/CLI.hpp>

namespace strobe {

/// The libraries of a run, and the warnings about those that could not be loaded.
struct LoadedPlugins {
    std::shared_ptr<const PluginLibraries> libraries;
    std::vector<std::string> warnings;
};

/// Loads the libraries of the arguments --plugin and of the folders of $STROBE_PLUGIN_PATH. Called before the
/// arguments are parsed, since help texts and completions name the plugins. Throws Error of kind Usage.
LoadedPlugins loadPlugins(int argc, char** argv);

/// Adds --plugin, whose values loadPlugins has read.
void addPluginOption(CLI::App& app);

} // namespace strobe
