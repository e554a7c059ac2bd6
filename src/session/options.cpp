#include "session/options.h"

#include "cli/option_validators.h"
#include "cli/progressive_options.h"
#include "cli/resource_options.h"
#include "session/sequence.h"

#include <CLI/CLI.hpp>

namespace strobe {

namespace {

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

[[noreturn]] void failUnknown(const char* option, const std::string& name, const std::string& known) {
    throw CLI::ValidationError(option, "unknown layer \"" + name + "\" (known: " + known + ")");
}

template <class T>
void addOnce(std::vector<T>& values, const T& value) {
    if (std::find(values.begin(), values.end(), value) == values.end())
        values.push_back(value);
}

void chooseAovs(const std::vector<std::string>& names, Options& options) {
    for (const std::string& name : names)
        if (const AovInfo* info = findAov(name))
            addOnce(options.aovs, info->aov);
        else
            failUnknown("--aov", name, aovNames());
}

/// An AOV that a heat map can show.
Aov heatmapAov(const char* option, const std::string& name) {
    const AovInfo* info = findAov(name);
    if (!info || info->group != AovGroup::Sharing)
        failUnknown(option, name, aovNames(AovGroup::Sharing));
    if (info->aov == Aov::Variance)
        throw CLI::ValidationError(option, "variance has no heat map");
    return info->aov;
}

/// "open,close" in frames.
void parseShutter(const std::string& text, Sequence& sequence) {
    char rest = 0;
    if (std::sscanf(text.c_str(), "%lf,%lf%c", &sequence.open, &sequence.close, &rest) != 2 ||
        !std::isfinite(sequence.open) || !std::isfinite(sequence.close) || sequence.open > sequence.close)
        throw CLI::ValidationError("--shutter", "takes open,close: two numbers that ascend");
}

/// What was given to all options but those that leave every picture as it is.
std::string imageAffectingOptions(const CLI::App& app) {
    static const std::set<std::string> others{"FILE",        "--output",  "--threads",   "--tile",
                                              "--quiet",     "--frames",  "--overwrite", "--stats",
                                              "--log-level", "--samples", "--partial",   "--display-server",
                                              "--reference", "--curve",   "--sandbox",   "--max-memory"};
    std::string words = "strobe " STROBE_VERSION "\n";
    for (const CLI::Option* option : app.get_options())
        if (!others.count(option->get_name()))
            for (const std::string& value : option->results())
                words += option->get_name() + "=" + value + "\n";
    if (const char* config = std::getenv("OCIO"))
        words += std::string("OCIO=") + config + "\n";
    return words;
}

/// Options that mean nothing without another.
void checkNeeds(const CLI::App& app, const Options& options) {
    for (const auto& [name, other] : {std::pair("--sample", "--pixel"), {"--heatmap-of", "--heatmap"}})
        if (app.count(name) > 0 && app.count(other) == 0)
            throw CLI::ValidationError(name, std::string("needs ") + other);
    const auto has = [&](Aov aov) {
        return std::find(options.aovs.begin(), options.aovs.end(), aov) != options.aovs.end();
    };
    if (app.count("--crypto-depth") > 0 && !has(Aov::CryptoObject) && !has(Aov::CryptoMaterial))
        throw CLI::ValidationError("--crypto-depth", "needs --aov cryptoobject or cryptomaterial");
}

/// The options of --frames, which go with no others.
void readSequence(const CLI::App& app, const std::string& frames, const std::string& shutter, double fps,
                  Options& options) {
    if (frames.empty()) {
        for (const char* name : {"--fps", "--shutter", "--overwrite"})
            if (app.count(name) > 0)
                throw CLI::ValidationError(name, "needs --frames");
        return;
    }
    options.sequence = parseFrames(frames);
    if (!options.sequence)
        throw CLI::ValidationError("--frames", "takes first:last or first:last:step: integers that ascend");
    if (app.count("--frame-time") > 0)
        throw CLI::ValidationError("--frame-time", "is of one frame: it does not go with --frames");
    if (options.pixel && options.sequence->first != options.sequence->last)
        throw CLI::ValidationError("--pixel", "is of one frame: it does not go with --frames of more");
    options.sequence->fps = fps;
    if (!shutter.empty())
        parseShutter(shutter, *options.sequence);
    options.command = imageAffectingOptions(app);
}

/// The command's name among the files is no scene.
void checkScenes(const std::vector<std::filesystem::path>& scenes) {
    std::error_code ignored;
    if (!scenes.empty() && scenes.front() == "merge" && !std::filesystem::exists("merge", ignored))
        throw CLI::ValidationError("merge", "comes first: strobe merge PART... -o OUT...");
}

} // namespace

void checkOutputName(const std::filesystem::path& output) {
    const auto extension = output.extension();
    if (extension != ".exr" && extension != ".png" && extension != ".part")
        throw CLI::ValidationError("-o", "\"" + output.string() + "\" must end in .exr, .png or .part");
}

std::optional<int> parseCommandLine(int argc, char** argv, Options& options) {
    CLI::App app{"strobe: how little can you shade and still be right?"};
    app.set_version_flag("--version", "strobe " STROBE_VERSION);
    app.footer("strobe merge PART... -o OUT... puts parts of a render together: see strobe merge --help");
    std::vector<float> crop;
    std::string pixel, resolution, heatmapOf = "shades";
    ProgressiveTexts progressive;
    std::vector<std::string> layers;
    std::string frames, shutter;
    double fps = Sequence().fps;
    std::optional<float> frameTime;

    app.add_option("FILE", options.scenes, "scene files (.scene, .pbrt), read one after another");
    app.add_option("--integrator", options.build.integrator, "what shares a shade; see --list");
    app.add_option("--shading", options.build.shading, "how a point is shaded; see --list");
    app.add_option("-D", options.build.defines, "name=value: a parameter of the integrator or of the shading")
        ->allow_extra_args(false);
    app.add_option("--spp", options.build.samplesPerPixel, "visibility samples per pixel")
        ->transform(integerFrom<int>(1));
    app.add_option("--resolution", resolution, "WxH: of the frame, in pixels");
    app.add_option("-o,--output", options.outputs, "output file (.exr, .png or .part); may be given again")
        ->allow_extra_args(false);
    addPictureOptions(app, options.picture);
    options.build.color = options.picture.color;
    app.add_flag("--print-ocio", options.printOcio, "print the built-in OpenColorIO config, and stop");
    app.add_option("--threads", options.threads, "threads; 0: one per core")->transform(integerFrom<int>(0));
    app.add_option("--tile", options.tile, "tile size in pixels; never changes the picture")
        ->transform(integerFrom<int>(1));
    app.add_option("--crop", crop, "x0 x1 y0 y1: part of the frame, fractions")->expected(4);
    app.add_option("--pixel", pixel, "x,y: render one pixel and print it");
    app.add_option("--sample", options.sample, "with --pixel: print one sample")
        ->transform(integerFrom<uint32_t>(0));
    app.add_option("--seed", options.seed, "seed of all random numbers")->transform(integerFrom<uint64_t>(0));
    app.add_option("--frame-time", frameTime, "render a still at this scene time")
        ->transform(finiteNumber<float>());
    app.add_option("--frames", frames, "first:last[:step]: render these frames into numbered files");
    app.add_option("--fps", fps, "frames per unit of scene time")
        ->transform(numberAboveZero<double>())
        ->capture_default_str();
    app.add_option("--shutter", shutter,
                   "open,close: when a frame's shutter opens and closes, in frames [0,0.5]");
    app.add_flag("--overwrite", options.overwrite, "render finished frames again");
    app.add_option("--animation", options.build.gltfAnimation, "the animation of glTF files that plays");
    app.add_option("--camera", options.build.gltfCamera, "the camera of glTF files that is taken");
    app.add_flag("--quick", options.build.quick, "a quarter of the resolution and of the samples");
    app.add_flag("--quiet", options.quiet, "print errors only");
    app.add_option("--aov", layers, "layers of EXR outputs: " + aovNames())->delimiter(',');
    app.add_option("--crypto-depth", options.cryptoLevels,
                   "how many things a pixel of a Cryptomatte layer can name")
        ->transform(integerBetween(1, 200));
    app.add_option("--heatmap", options.heatmapFile, "write a layer in false color, with its scale (.png)");
    app.add_option("--heatmap-of", heatmapOf, "the layer that --heatmap shows");
    app.add_option("--samples", options.samplesFile,
                   "write every visibility sample as CSV: of a small --crop, unless the disk is large");
    app.add_option("--stats", options.statsFile, "write statistics as JSON");
    app.add_option("--log-level", options.logLevel, "debug, info, warn or error")
        ->check(CLI::IsMember({"debug", "info", "warn", "error"}));
    addProgressiveOptions(app, options, progressive);
    addGuardOptions(app, options);
    app.add_flag("--list", options.list, "print every plugin with its parameters, and stop");

    try {
        app.parse(argc, argv);
        if (!pixel.empty()) {
            V2i p;
            char comma = 0, rest = 0;
            if (std::sscanf(pixel.c_str(), "%d%c%d%c", &p.x, &comma, &p.y, &rest) != 3 || comma != ',')
                throw CLI::ValidationError("--pixel", "takes x,y, two integers");
            options.pixel = p;
        }
        if (!resolution.empty())
            options.build.resolution = parseResolution(resolution);
        if (!crop.empty()) {
            if (!(crop[0] < crop[1] && crop[2] < crop[3]))
                throw CLI::ValidationError("--crop", "takes x0 x1 y0 y1 with x0 < x1 and y0 < y1");
            options.build.crop = {crop[0], crop[1], crop[2], crop[3]};
        }
        for (const auto& output : options.outputs)
            checkOutputName(output);
        if (!options.heatmapFile.empty() && options.heatmapFile.extension() != ".png")
            throw CLI::ValidationError("--heatmap",
                                       "\"" + options.heatmapFile.string() + "\" must end in .png");
        if (frameTime)
            options.build.shutter = Shutter{*frameTime, *frameTime};
        readSequence(app, frames, shutter, fps, options);
        chooseAovs(layers, options);
        readProgressiveOptions(progressive, options);
        options.heatmapAov = heatmapAov("--heatmap-of", heatmapOf);
        checkNeeds(app, options);
        checkScenes(options.scenes);
        if (options.scenes.empty() && !options.list && !options.printOcio)
            throw CLI::RequiredError("FILE");
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? kOk : kUsageError;
    }
    return std::nullopt;
}

} // namespace strobe
