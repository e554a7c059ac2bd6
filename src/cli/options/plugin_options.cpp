#include "cli/options/plugin_options.h"

#include "loader/build/plugin_tables.h"

#include <cstdlib>

namespace strobe {

namespace {

constexpr const char* kOption = "--plugin";

std::vector<std::filesystem::path> pluginArguments(int argc, char** argv) {
    const std::string withValue = std::string(kOption) + '=';
    std::vector<std::filesystem::path> files;
    for (int i = 1; i < argc && std::string_view(argv[i]) != "--"; ++i) {
        const std::string argument = argv[i];
        if (argument.starts_with(withValue))
            files.push_back(argument.substr(withValue.size()));
        else if (argument == kOption && i + 1 < argc)
            files.push_back(argv[++i]);
    }
    return files;
}

/// Returns the folders of a list that is separated by colons.
std::vector<std::filesystem::path> splitPath(const char* list) {
    std::vector<std::filesystem::path> folders;
    if (list)
        for (const std::string& folder : CLI::detail::split(list, ':'))
            if (!folder.empty())
                folders.push_back(folder);
    return folders;
}

} // namespace

LoadedPlugins loadPlugins(int argc, char** argv) {
    LoadedPlugins loaded;
    Diagnostics diagnostics([&](const std::string& text) { loaded.warnings.push_back(text); });
    loaded.libraries = std::make_shared<const PluginLibraries>(loadPluginLibraries(
        pluginArguments(argc, argv), splitPath(std::getenv("STROBE_PLUGIN_PATH")), diagnostics));
    pluginTables(*loaded.libraries); // throws if names are taken
    return loaded;
}

void addPluginOption(CLI::App& app) {
    app.add_option_function<std::vector<std::string>>(
           kOption, [](const std::vector<std::string>&) {},
           "library of plugins (.so), in a folder of $STROBE_PLUGIN_PATH or by its path; may be repeated. "
           "All libraries in these folders are loaded")
        ->type_name("FILE")
        ->allow_extra_args(false);
}

} // namespace strobe
