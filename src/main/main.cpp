// The command line program: parse, build, render, develop.
#include "core/heatmap.h"
#include "main/options.h"
#include "main/progress.h"
#include "main/report.h"
#include "main/sample_table.h"
#include "scene/parser.h"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <unistd.h>

namespace strobe {
namespace {

double secondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Where the picture goes: -o, else the scene's own name, else the scene file's stem, in the current folder.
std::vector<std::filesystem::path> outputsOf(const Options& options, const BuiltScene& built,
                                             spdlog::logger& log) {
    if (!options.outputs.empty())
        return options.outputs;
    std::filesystem::path path = built.filename;
    if (path.empty())
        path = options.scenes.front().stem().string() + ".exr";
    if (path.extension() != ".exr" && path.extension() != ".png") {
        log.warn("\"{}\" is not a kind of file written here; writing .exr instead", path.string());
        path.replace_extension(".exr");
    }
    return {path};
}

/// Finds out before the work, not after it, that a file cannot be written.
void checkWritable(const std::filesystem::path& path) {
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    if (access(folder.c_str(), W_OK | X_OK) != 0)
        throw Error("cannot write \"" + path.string() + "\": " + std::strerror(errno), ErrorKind::Output);
    if (std::filesystem::is_directory(path))
        throw Error("cannot write \"" + path.string() + "\": it is a folder", ErrorKind::Output);
}

void printPixel(const Options& options, const BuiltScene& built, RenderSettings settings) {
    const V2i p = *options.pixel;
    if (p.x < 0 || p.y < 0 || p.x >= built.resolution.x || p.y >= built.resolution.y)
        throw Error(fmt::format("--pixel {},{}: the frame has {}x{} pixels", p.x, p.y, built.resolution.x,
                                built.resolution.y),
                    ErrorKind::Usage);
    if (options.sample && *options.sample >= uint32_t(settings.samplesPerPixel))
        throw Error(
            fmt::format("--sample {}: a pixel has {} samples", *options.sample, settings.samplesPerPixel),
            ErrorKind::Usage);
    settings.probe = [&](const SampleReport& report) {
        if (options.sample == report.number)
            fmt::print("pixel {},{} sample {}: {:.9g} {:.9g} {:.9g}\n", p.x, p.y, report.number,
                       report.value.x, report.value.y, report.value.z);
    };
    Film film(built.resolution.x, built.resolution.y, {p.x, p.y, p.x + 1, p.y + 1});
    render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter, settings,
           film);
    const Rgb& mean = film.image().pixels[0];
    if (!options.sample)
        fmt::print("pixel {},{}: {:.9g} {:.9g} {:.9g}\n", p.x, p.y, mean.x, mean.y, mean.z);
}

void warnOfBadSamples(const RenderStats& stats, spdlog::logger& log) {
    if (stats.total.badSamples == 0)
        return;
    log.warn("{} samples were NaN, infinite or beyond 2.8e14 and are left out; the first:",
             stats.total.badSamples);
    for (const BadSample& bad : stats.total.firstBad)
        log.warn("  replay with --pixel {},{} --sample {}", bad.x, bad.y, bad.sample);
}

std::set<std::string> sharingNames() {
    std::set<std::string> names;
    for (const auto& row : pluginTables().integrators)
        names.insert(row.name);
    return names;
}

/// The layers that outputs show.
std::vector<Layer> layersOf(const Options& options) {
    std::vector<Layer> layers = options.layers;
    if (!options.heatmapFile.empty() &&
        std::find(layers.begin(), layers.end(), options.heatmapLayer) == layers.end())
        layers.push_back(options.heatmapLayer);
    return layers;
}

int run(const Options& options, spdlog::logger& log) {
    if (options.list) {
        fmt::print("{}", listPlugins(pluginTables()));
        return kOk;
    }
    if (!options.build.integrator.empty())
        findPlugin(pluginTables().integrators, options.build.integrator, "integrator", {});
    if (!options.build.shading.empty())
        findPlugin(pluginTables().shaders, options.build.shading, "shading integrator", {});
    for (const auto& output : options.outputs)
        checkWritable(output);
    for (const auto& file : {options.statsFile, options.heatmapFile, options.samplesFile})
        if (!file.empty())
            checkWritable(file);

    Messages messages([&](const std::string& text) { log.warn("{}", text); });
    StepSeconds seconds;
    auto start = std::chrono::steady_clock::now();
    SceneDescription description = parseFiles(options.scenes, sharingNames(), messages);
    seconds.parse = secondsSince(start);
    start = std::chrono::steady_clock::now();
    BuiltScene built = buildScene(std::move(description), options.build, messages);
    seconds.build = secondsSince(start);
    log.debug("parsed in {:.3f} s, built in {:.3f} s", seconds.parse, seconds.build);

    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.seed = options.seed;
    settings.threads = options.threads;
    settings.tileSize = options.tile;
    if (options.pixel) {
        printPixel(options, built, settings);
        return kOk;
    }
    const auto outputs = outputsOf(options, built, log);
    for (const auto& output : outputs)
        checkWritable(output);
    Progress progress(options.quiet);
    settings.progress = [&](double fraction) { progress.update(fraction); };
    SampleTable samples;
    if (!options.samplesFile.empty())
        settings.probe = [&](const SampleReport& report) { samples.add(report); };
    Film film(built.resolution.x, built.resolution.y, built.window, layersOf(options));
    const RenderStats stats = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                                     *built.filter, settings, film);
    seconds.render = stats.seconds;
    progress.finish();

    warnOfBadSamples(stats, log);
    for (const auto& output : outputs)
        film.write(output, renderMetadata(built, options, stats, seconds));
    if (!options.heatmapFile.empty())
        writePng(options.heatmapFile, heatmap(film, options.heatmapLayer, settings.samplesPerPixel),
                 renderMetadata(built, options, stats, seconds));
    if (!options.samplesFile.empty())
        samples.write(options.samplesFile);
    if (!options.statsFile.empty())
        writeStats(options.statsFile, built, options, stats, seconds);
    log.info("{}", summary(built, stats, seconds));
    for (const auto& output : outputs)
        log.info("wrote {}", output.string());
    return kOk;
}

int exitCodeOf(ErrorKind kind) {
    switch (kind) {
    case ErrorKind::Usage:
        return kUsageError;
    case ErrorKind::Scene:
        return kSceneError;
    case ErrorKind::Output:
        return kOutputError;
    }
    return kInternalError;
}

int guardedMain(int argc, char** argv) {
    Options options;
    if (const auto code = parseCommandLine(argc, argv, options))
        return *code;
    spdlog::logger log("strobe", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
    log.set_pattern("%v");
    log.set_level(options.quiet ? spdlog::level::err : spdlog::level::from_str(options.logLevel));
    try {
        return run(options, log);
    } catch (const Error& e) {
        log.error("{}", formatDiagnostic(e.location, "error", e.what()));
        return exitCodeOf(e.kind);
    } catch (const std::bad_alloc&) {
        log.error("error: out of memory");
        return kSceneError;
    } catch (const std::exception& e) {
        log.error("internal error: {}", e.what());
        return kInternalError;
    }
}

} // namespace
} // namespace strobe

int main(int argc, char** argv) { return strobe::guardedMain(argc, argv); }
