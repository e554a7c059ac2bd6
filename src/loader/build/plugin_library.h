// Libraries of plugins that are loaded at run time.
#pragma once

#include "core/math/api.h"
#include "loader/build/plugin_rows.h"
#include "loader/parser/description.h"

#include <filesystem>
#include <set>

namespace STROBE_API strobe {

/// A loaded library. It stays loaded until the process ends, since its objects may live as long.
struct PluginLibrary {
    std::filesystem::path path;
    uint64_t hash = 0; ///< of its content
    PluginRows rows;
};

using PluginLibraries = std::vector<PluginLibrary>;

/// Loads a library that was made with STROBE_PLUGIN_LIBRARY (strobe/plugin.h). Throws Error of kind Usage,
/// which says what helps, if the file is not a complete shared library for this processor, has no plugins of
/// strobe, was made for another ABI (strobe's version, its public headers, the C++ library, the C++ level),
/// or cannot be loaded. No code of the file runs before these are checked. After an exception of a static
/// initializer the process should end: the dynamic loader stays locked for other threads.
PluginLibrary loadPluginLibrary(const std::filesystem::path& path);

/// Loads the libraries of `files`, and all files called *.so in `folders`, in the order of their names. Names
/// in `files` without a slash are looked for in the folders, too. Throws Error if one of `files` cannot be
/// loaded, or if a static initializer throws; for the others, warns.
PluginLibraries loadPluginLibraries(const std::vector<std::filesystem::path>& files,
                                    const std::vector<std::filesystem::path>& folders,
                                    Diagnostics& diagnostics);

/// Returns the names and the hashes of the libraries that have a plugin that the scene names, or `names`.
std::vector<std::pair<std::string, uint64_t>> usedPlugins(const PluginLibraries& libraries,
                                                          const SceneDescription& description,
                                                          std::set<std::string> names);

/// Returns the ABI of this build: fields `name=value`, separated by blanks.
const char* pluginAbi();

} // namespace strobe
