#include "cli/merge_command_line.h"

#include "cli/standard_streams.h"

#include "cli/help.h"
#include "cli/options/image_options.h"
#include "cli/options/plugin_options.h"
#include "core/image/image_format.h"

namespace strobe {

std::optional<ExitCode> parseMergeCommandLine(int argc, char** argv, MergeCommandLine& line) {
    MergeOptions& merge = line.merge;
    CLI::App app{"strobe merge: merges parts of a render"};
    useWideHelp(app);
    app.set_help_flag("-h,--help", "print the options and exit");
    app.add_option("PART", merge.parts, ".part files of one render")->type_name("")->required();
    app.add_option("-o,--output", merge.images,
                   "output file (" + imageExtensions() + " or .part); may be repeated")
        ->type_name("FILE")
        ->allow_extra_args(false)
        ->required();
    LoadedPlugins plugins = loadPlugins(argc, argv);
    merge.plugins = plugins.libraries;
    line.warnings = std::move(plugins.warnings);
    addPluginOption(app);
    app.add_flag("--mkdir", merge.makeFolders, "create the folders of outputs");
    addImageOptions(app, merge.format);
    app.add_flag("--allow-missing", merge.allowMissing,
                 "write an image of the parts that there are; without it, missing samples are an error");
    app.add_flag("--strict", merge.strict, "exit with code 6 if a sample is NaN, infinite or too large");
    app.add_flag("-q,--quiet", line.quiet, "print errors only");
    try {
        app.parse(argc, argv);
        try {
            nameStandardOutput(merge.images);
            checkOptions(merge);
        } catch (const Error& e) {
            throw CLI::ValidationError(e.what());
        }
    } catch (const CLI::ParseError& e) {
        return printParseResult(app, e);
    }
    return std::nullopt;
}

} // namespace strobe
