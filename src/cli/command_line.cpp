#include "cli/command_line.h"

#include "cli/standard_streams.h"

#include "cli/help.h"
#include "cli/options/image_options.h"
#include "cli/options/option_validators.h"
#include "cli/options/plugin_options.h"
#include "cli/options/progressive_options.h"
#include "cli/options/resource_options.h"
#include "cli/options/sequence_options.h"
#include "core/image/image_format.h"
#include "core/util/version.h"
#include "loader/build/plugin_tables.h"

#include <CLI/CLI.hpp>

namespace strobe {

namespace {

constexpr const char* kFooter = R"(
strobe merge PART... -o OUT... merges parts of a render: see strobe merge --help

Exit codes:
  0  success
  1  invalid command line
  2  error in a scene file or in a file that it names, or out of memory
  3  an output cannot be written, or would replace an input
  4  internal error of strobe
  5  a signal ended a render; the finished samples or passes are saved
  6  invalid samples (--strict))";

template <class Row>
std::string namesOf(const std::vector<Row>& table) {
    std::string names;
    for (const Row& row : table)
        names += (names.empty() ? "" : ", ") + row.name;
    return names;
}

std::string aovNames() {
    return aovNames(AovGroup::Visible) + ", " + aovNames(AovGroup::Light) + ", " +
           aovNames(AovGroup::Sharing);
}

V2i parseResolution(const std::string& text) {
    constexpr int kMax = 1 << 16;
    long long x = 0, y = 0;
    char rest = 0;
    if (std::sscanf(text.c_str(), "%lldx%lld%c", &x, &y, &rest) != 2 || std::min(x, y) < 1 ||
        std::max(x, y) > kMax)
        throw CLI::ValidationError("--resolution",
                                   "takes WxH, two integers from 1 to " + std::to_string(kMax));
    return {int(x), int(y)};
}

std::array<float, 4> parseCrop(const std::vector<float>& crop) {
    if (!(crop[0] < crop[1] && crop[2] < crop[3]))
        throw CLI::ValidationError("--crop", "takes x0 x1 y0 y1 with x0 < x1 and y0 < y1");
    if (std::any_of(crop.begin(), crop.end(), [](float edge) { return edge < 0 || edge > 1; }))
        throw CLI::ValidationError("--crop", "takes fractions of the frame, from 0 to 1");
    return {crop[0], crop[1], crop[2], crop[3]};
}

V2i parsePixel(const std::string& text) {
    V2i pixel;
    char comma = 0, rest = 0;
    if (std::sscanf(text.c_str(), "%d%c%d%c", &pixel.x, &comma, &pixel.y, &rest) != 3 || comma != ',')
        throw CLI::ValidationError("--pixel", "takes x,y, two integers");
    return pixel;
}

[[noreturn]] void failUnknown(const char* option, const std::string& name, const std::string& known) {
    throw CLI::ValidationError(option, "unknown layer \"" + name + "\" (known: " + known + ")");
}

/// Returns the AOVs of these names, each once.
std::vector<Aov> parseAovs(const std::vector<std::string>& names) {
    std::vector<Aov> aovs;
    for (const std::string& name : names) {
        const AovInfo* info = findAov(name);
        if (!info)
            failUnknown("--aov", name, aovNames());
        if (std::find(aovs.begin(), aovs.end(), info->aov) == aovs.end())
            aovs.push_back(info->aov);
    }
    return aovs;
}

Aov parseHeatmapAov(const std::string& name) {
    const AovInfo* info = findAov(name);
    if (!info || info->group != AovGroup::Sharing)
        failUnknown("--heatmap-of", name, aovNames(AovGroup::Sharing));
    return info->aov;
}

void addGltfOptions(CLI::App& app, BuildOptions& build) {
    app.add_option("--animation", build.gltfAnimation, "name of the glTF animation to play")
        ->type_name("NAME");
    app.add_option("--camera", build.gltfCamera, "name of the glTF camera to use")->type_name("NAME");
    app.add_option_function<std::string>(
           "--gltf-lights",
           [&build](const std::string& units) {
               if (units != "photometric" && units != "web")
                   throw CLI::ValidationError("--gltf-lights", "takes photometric or web");
               build.gltfPhotometric = units == "photometric";
           },
           "units of the lights of glTF files: photometric (candela and lux, divided by 683 lm/W) or web "
           "(taken as W/sr and W/m², as web viewers do) [photometric]")
        ->type_name("UNITS");
    app.add_flag("--gltf-culling", build.gltfCulling,
                 "camera rays pass through the back of glTF surfaces that are not doubleSided");
    app.add_option(
           "--gltf-points", build.gltfPointRadius,
           "show points and lines of glTF files as spheres and tubes of this radius, in units of the file")
        ->type_name("RADIUS")
        ->transform(numberAboveZero<float>());
    app.add_flag("--ground", build.gltfGround, "add a matte floor below glTF files, for their shadows");
}

void addSceneOptions(CLI::App& app, RenderOptions& render, const PluginTables& tables) {
    BuildOptions& build = render.build;
    app.option_defaults()->group("Scene and integrator");
    app.add_option(
           "FILE", render.scenes,
           "scene files (.scene, .pbrt, .gltf, .glb), read one after another as if they were one file; -: "
           "standard input")
        ->type_name("");
    app.add_option("--integrator", build.integrator,
                   "mapping of visibility samples to shades; overrides the scene: " +
                       namesOf(tables.integrators))
        ->type_name("NAME");
    app.add_option("--shading", build.shading, "shader; overrides the scene: " + namesOf(tables.shaders))
        ->type_name("NAME");
    app.add_option("-D", build.defines,
                   "value of $NAME in the scene, or parameter of the integrator or of the shader")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    app.add_option(
           "--spp", build.samplesPerPixel,
           "visibility samples per pixel; overrides the scene; the sampler sobol rounds up to a power of two")
        ->type_name("N")
        ->transform(integerFrom<int>(1));
    app.add_option_function<std::string>(
           "--resolution", [&build](const std::string& text) { build.resolution = parseResolution(text); },
           "size of the frame in pixels; overrides the scene")
        ->type_name("WxH");
    addGltfOptions(app, build);
    app.add_flag("--quick", build.quick, "a quarter of the resolution and of the samples per pixel");
    app.add_flag("--dry-run", render.dryRun,
                 "load and check the scene, and estimate time and memory; write --stats only");
    app.add_option("--expect", render.expected,
                   "end with an error, which names the files, unless the version and the scene are those of "
                   "these --stats")
        ->type_name("FILE");
}

void addImageOutputs(CLI::App& app, CommandLine& line) {
    app.option_defaults()->group("Images");
    app.add_option("-o,--output", line.render.output.images,
                   "output file (" + imageExtensions() +
                       " or .part); -: an EXR to standard output, -.png: a PNG; by "
                       "default the name in the scene, or the name of the first scene file with .exr")
        ->type_name("FILE")
        ->allow_extra_args(false);
    app.add_flag("--no-output", line.render.output.noImage, "write no image");
    app.add_flag("--mkdir", line.render.output.makeFolders, "create the folders of outputs");
    app.add_flag(
        "--transparent", line.render.build.transparent,
        "transparent background, with the channel A in EXR, PNG and TIFF; reflections and refractions "
        "show the environment");
    addImageOptions(app, line.render.output.format);
    line.render.build.color = line.render.output.format.color;
}

void addSampleOptions(CLI::App& app, CommandLine& line, std::optional<uint32_t>& sample) {
    RenderOptions& render = line.render;
    app.option_defaults()->group("Pixels, samples and time");
    app.add_option("-t,--threads", render.threads,
                   "number of threads; 0: one per core; does not change the image [0]")
        ->type_name("N")
        ->transform(integerBetween(0, 4096));
    app.add_option(
           "--tile", render.tileSize,
           "tile size in pixels; changes the image only with scopes thread, mutex and tile of msaa-cache, "
           "and with integrators that declare it [32]")
        ->type_name("N")
        ->transform(integerFrom<int>(1));
    app.add_option_function<std::vector<float>>(
           "--crop", [&render](const std::vector<float>& crop) { render.build.crop = parseCrop(crop); },
           "region of the frame to render, in fractions of its size")
        ->type_name("X0 X1 Y0 Y1")
        ->expected(4)
        ->allow_extra_args(false);
    app.add_option_function<std::string>(
           "--pixel",
           [&line](const std::string& text) {
               line.pixel = PixelQuery{parsePixel(text), {}};
           },
           "render one pixel and print it; writes no file")
        ->type_name("X,Y");
    app.add_option("--sample", sample, "with --pixel: print one visibility sample, by number")
        ->type_name("N")
        ->transform(integerFrom<uint32_t>(0));
    app.add_option("--seed", render.seed, "seed of the random numbers [0]")
        ->type_name("N")
        ->transform(integerFrom<uint64_t>(0));
    app.add_option_function<float>(
           "--frame-time",
           [&render](float time) {
               render.build.shutter = Shutter{time, time};
           },
           "scene time of a still without motion blur")
        ->type_name("T")
        ->transform(finiteNumber<float>());
}

void addLayerOptions(CLI::App& app, OutputOptions& output) {
    app.option_defaults()->group("AOVs and statistics");
    app.add_option_function<std::vector<std::string>>(
           "--aov", [&output](const std::vector<std::string>& names) { output.aovs = parseAovs(names); },
           "layers of EXR outputs, separated by commas: " + aovNames())
        ->type_name("NAMES")
        ->delimiter(',');
    app.add_option("--crypto-depth", output.cryptomatteEntries,
                   "number of names per pixel in Cryptomatte layers [6]")
        ->type_name("N")
        ->transform(integerBetween(1, 200));
    app.add_option("--heatmap", output.heatmap,
                   "write a layer in false color, with a scale, to this .png file")
        ->type_name("FILE");
    app.add_option_function<std::string>(
           "--heatmap-of", [&output](const std::string& name) { output.heatmapAov = parseHeatmapAov(name); },
           "layer of --heatmap [shades]")
        ->type_name("NAME");
    app.add_option(
           "--samples", output.samples,
           "write every visibility sample to this CSV file; for a small --crop, since files are large")
        ->type_name("FILE");
    app.add_option("--stats", output.stats, "write statistics to this JSON file; -: to standard output")
        ->type_name("FILE");
}

/// Throws if an option was given that has no effect.
void checkRequirements(const CLI::App& app, const OutputOptions& output) {
    for (const auto& [name, required] : {std::pair("--sample", "--pixel"), {"--heatmap-of", "--heatmap"}})
        if (app.count(name) > 0 && app.count(required) == 0)
            throw CLI::ValidationError(name, std::string("needs ") + required);
    const auto has = [&](Aov aov) {
        return std::find(output.aovs.begin(), output.aovs.end(), aov) != output.aovs.end();
    };
    if (app.count("--crypto-depth") > 0 && !has(Aov::CryptoObject) && !has(Aov::CryptoMaterial))
        throw CLI::ValidationError("--crypto-depth", "needs --aov cryptoobject or cryptomaterial");
}

void checkScenes(const CommandLine& line) {
    const auto& scenes = line.render.scenes;
    std::error_code ignored;
    if (!scenes.empty() && scenes.front() == "merge" && !std::filesystem::exists("merge", ignored))
        throw CLI::ValidationError("merge", "must be the first argument: strobe merge PART... -o OUT...");
    if (scenes.empty() && !line.list && !line.printOcio && line.text.empty())
        throw CLI::RequiredError("FILE");
}

/// Throws the errors of checkOptions as those of the command line.
void checkRenderOptions(const CommandLine& line) {
    try {
        if (line.pixel)
            checkPixelOptions(line.render);
        else
            checkOptions(line.render);
    } catch (const Error& e) {
        throw CLI::ValidationError(e.what());
    }
}

/// Returns the arguments with current names of options in place of former names, which --help does not list.
std::vector<std::string> withCurrentNames(int argc, char** argv) {
    constexpr std::pair<std::string_view, std::string_view> kRenamed[] = {{"--partial", "--write-interval"}};
    std::vector<std::string> arguments(argv, argv + argc);
    for (std::string& argument : arguments)
        for (const auto& [former, current] : kRenamed)
            if (argument == former || argument.starts_with(std::string(former) + '='))
                argument.replace(0, former.size(), current);
    return arguments;
}

/// Returns the words of options that take one of several.
std::vector<Completion> completions(const PluginTables& tables) {
    const auto split = [](const std::string& names) {
        std::vector<std::string> words;
        for (const std::string& name : CLI::detail::split(names, ','))
            words.push_back(CLI::detail::trim_copy(name));
        return words;
    };
    return {{"--integrator", split(namesOf(tables.integrators))},
            {"--shading", split(namesOf(tables.shaders))},
            {"--aov", split(aovNames())},
            {"--heatmap-of", split(aovNames(AovGroup::Sharing))},
            {"--log-level", {"debug", "info", "warn", "error"}},
            {"--print-completion", {"bash", "zsh", "fish"}}};
}

/// Sets what follows from other options.
void completeOptions(RenderOptions& render, bool isPixel, const std::vector<std::string>& arguments) {
    OutputOptions& output = render.output;
    nameStandardOutput(output.images);
    const bool hasAlpha = std::find(output.aovs.begin(), output.aovs.end(), Aov::Alpha) != output.aovs.end();
    if (render.build.transparent && !hasAlpha && !isPixel)
        output.aovs.push_back(Aov::Alpha);
    for (const std::string& argument : arguments)
        render.commandLine += (render.commandLine.empty() ? "" : " ") + argument;
}

void parse(CLI::App& app, const std::vector<std::string>& arguments) {
    std::vector<const char*> argv;
    for (const std::string& argument : arguments)
        argv.push_back(argument.c_str());
    app.parse(int(argv.size()), argv.data());
}

} // namespace

std::optional<ExitCode> parseCommandLine(int argc, char** argv, CommandLine& line) {
    CLI::App app{"strobe: a pbrt-style renderer that shades less often than it samples visibility"};
    app.set_help_flag("-h,--help", "print the options and exit");
    useWideHelp(app);
    app.set_version_flag("-V,--version", std::string("strobe ") + version(), "print the version and exit");
    app.footer(kFooter);
    SequenceOptions sequence;
    std::optional<uint32_t> sample;
    LoadedPlugins plugins = loadPlugins(argc, argv);
    line.render.build.plugins = plugins.libraries;
    line.warnings = std::move(plugins.warnings);
    const PluginTables tables = pluginTables(*plugins.libraries);
    addSceneOptions(app, line.render, tables);
    addPluginOption(app);
    addImageOutputs(app, line);
    addSampleOptions(app, line, sample);
    addSequenceOptions(app, sequence);
    app.option_defaults()->group("Messages");
    app.add_flag("-q,--quiet", line.quiet, "print errors only");
    app.add_option("--log-level", line.logLevel,
                   "least severity of messages: debug, info, warn or error [info]")
        ->type_name("LEVEL")
        ->check(CLI::IsMember({"debug", "info", "warn", "error"}).description(""));
    addLayerOptions(app, line.render.output);
    addProgressiveOptions(app, line.render);
    addResourceOptions(app, line.render);
    app.option_defaults()->group("Information");
    app.add_option_function<std::string>(
           "--list",
           [&line](const std::string& name) {
               line.list = true;
               line.listName = name;
           },
           "print the plugins of this name, or all plugins and AOVs, with their parameters, and exit")
        ->type_name("[NAME]")
        ->expected(0, 1)
        ->default_str("");
    app.add_flag("--print-ocio", line.printOcio, "print the built-in OpenColorIO config and exit");
    app.add_flag_callback(
        "--print-man", [&app, &line] { line.text = manPage(app); }, "print the manual page and exit");
    app.add_option_function<std::string>(
           "--print-completion",
           [&](const std::string& shell) { line.text = completionScript(app, completions(tables), shell); },
           "print the completions for a shell, bash, zsh or fish, and exit")
        ->type_name("SHELL");
    try {
        const std::vector<std::string> arguments = withCurrentNames(argc, argv);
        parse(app, arguments);
        if (line.pixel)
            line.pixel->sample = sample;
        completeOptions(line.render, line.pixel.has_value(), arguments);
        readSequenceOptions(app, sequence, line.render);
        checkRequirements(app, line.render.output);
        checkRenderOptions(line);
        checkScenes(line);
    } catch (const CLI::ParseError& e) {
        return printParseResult(app, e);
    }
    return std::nullopt;
}

} // namespace strobe
