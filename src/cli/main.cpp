// The command line program: parse, build, render, develop.
#include "cli/resource_options.h"
#include "core/film/heatmap.h"
#include "core/util/memory.h"
#include "loader/parser/content_hash.h"
#include "loader/parser/parser.h"
#include "session/aov_films.h"
#include "session/checkpoint.h"
#include "session/fallback_writer.h"
#include "session/merge.h"
#include "session/options.h"
#include "session/outputs.h"
#include "session/render_session.h"
#include "session/report.h"
#include "session/sample_table.h"
#include "session/sequence.h"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <ctime>
#include <fstream>
#include <numeric>
#include <sstream>

#include <unistd.h>

namespace strobe {
namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// When the system began to load the program: what a user sees as the start. (Or now, where that cannot be
/// told.)
Clock::time_point processStart() {
    std::ifstream file("/proc/self/stat");
    const std::string stat{std::istreambuf_iterator<char>(file), {}};
    std::istringstream fields(stat.substr(std::min(stat.rfind(')') + 1, stat.size())));
    std::string field; // the third of them all is the first here; the start, in ticks since boot, is the 22nd
    for (int i = 3; i <= 22; ++i)
        fields >> field;
    timespec now;
    if (!fields || clock_gettime(CLOCK_BOOTTIME, &now) != 0)
        return Clock::now();
    const double age = double(now.tv_sec) + 1e-9 * double(now.tv_nsec) -
                       std::strtod(field.c_str(), nullptr) / double(sysconf(_SC_CLK_TCK));
    return Clock::now() - std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(age));
}

/// The options that, beside those of the picture, render this sample alone.
std::string replayOf(const InvalidSample& bad, const Options& options, const BuiltScene& built) {
    std::string words = fmt::format("--pixel {},{} --sample {}", bad.x, bad.y, bad.sample);
    if (options.frame)
        words += fmt::format(" --frames {0}:{0}", *options.frame);
    if (bad.seed != options.seed)
        words += fmt::format(" --seed {}", bad.seed);
    if (bad.samplesPerPixel != built.sampler.samplesPerPixel)
        words += fmt::format(" --spp {}", bad.samplesPerPixel);
    return words;
}

void warnOfInvalidSamples(const RenderStats& stats, const Options& options, const BuiltScene& built,
                          spdlog::logger& log) {
    if (stats.total.clampedSamples > 0)
        log.warn("--clamp {} made {} samples darker: the picture is biased", options.clamp,
                 stats.total.clampedSamples);
    if (stats.total.invalidSamples == 0)
        return;
    log.log(options.strict ? spdlog::level::err : spdlog::level::warn,
            "{} samples were NaN, infinite or beyond 2.8e14 and are left out{}", stats.total.invalidSamples,
            stats.total.firstInvalid.empty() ? "" : "; the first:");
    for (const InvalidSample& bad : stats.total.firstInvalid)
        log.warn("  replay with {}", replayOf(bad, options, built));
}

/// Returns the exit code.
int printPixel(const Options& options, const BuiltScene& built, RenderSettings settings,
               spdlog::logger& log) {
    const V2i p = *options.pixel;
    if (p.x < 0 || p.y < 0 || p.x >= built.resolution.x || p.y >= built.resolution.y)
        throw Error(fmt::format("--pixel {},{}: the frame has {}x{} pixels", p.x, p.y, built.resolution.x,
                                built.resolution.y),
                    ErrorKind::Usage);
    if (options.sample && *options.sample >= uint32_t(settings.samplesPerPixel))
        throw Error(
            fmt::format("--sample {}: a pixel has {} samples", *options.sample, settings.samplesPerPixel),
            ErrorKind::Usage);
    settings.onSample = [&](const SampleRecord& report) {
        if (options.sample == report.number)
            fmt::print("pixel {},{} sample {}: {:.9g} {:.9g} {:.9g}\n", p.x, p.y, report.number,
                       report.value.x, report.value.y, report.value.z);
    };
    Film film(built.resolution.x, built.resolution.y, {p.x, p.y, p.x + 1, p.y + 1});
    const RenderStats stats = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                                     *built.filter, settings, film);
    warnOfInvalidSamples(stats, options, built, log);
    const Rgb& mean = film.image().pixels[0];
    if (!options.sample)
        fmt::print("pixel {},{}: {:.9g} {:.9g} {:.9g}\n", p.x, p.y, mean.x, mean.y, mean.z);
    return options.strict && stats.total.invalidSamples > 0 ? kInvalidSamples : kOk;
}

std::set<std::string> sharingNames() {
    std::set<std::string> names;
    for (const auto& row : pluginTables().integrators)
        names.insert(row.name);
    return names;
}

/// The AOVs that the film holds.
std::vector<Aov> filmAovs(const Options& options) {
    std::vector<Aov> aovs = aovsOf(options.aovs, AovGroup::Sharing);
    if (!options.heatmapFile.empty() && std::find(aovs.begin(), aovs.end(), options.heatmapAov) == aovs.end())
        aovs.push_back(options.heatmapAov);
    return aovs;
}

/// Throws where there is no such plugin; of one of the others, says which option is theirs.
template <class Row, class Other>
void checkPlugin(const std::string& name, const char* kind, const char* option, const std::vector<Row>& table,
                 const char* othersOption, const std::vector<Other>& others) {
    if (name.empty())
        return;
    if (std::any_of(others.begin(), others.end(), [&](const Other& row) { return row.name == name; }))
        throw Error(fmt::format("{0} {1}: that is chosen by {2} {1}", option, name, othersOption),
                    ErrorKind::Usage);
    findPlugin(table, name, kind, {});
}

/// Everything that can be found wrong before a scene is read.
void checkOptions(const Options& options) {
    const PluginTables tables = pluginTables();
    checkPlugin(options.build.integrator, "integrator", "--integrator", tables.integrators, "--shading",
                tables.shaders);
    checkPlugin(options.build.shading, "shading integrator", "--shading", tables.shaders, "--integrator",
                tables.integrators);
    outputSettingsOf(options.picture, options.threads);
    checkOutputs(options);
}

RenderSettings settingsOf(const Options& options, const FrameSetup& built) {
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.samplesPerPixel;
    settings.slice = options.samples;
    settings.seed = options.seed;
    settings.clamp = options.clamp;
    settings.threads = options.threads;
    settings.tileSize = options.tile;
    return settings;
}

/// Renders a picture and writes all that is asked for, the outputs first. `start`: when its time began to
/// count. `guard`: of the scene. Returns the exit code.
int makePicture(const Options& options, const BuiltScene& built, const ResourcePolicy& guard,
                StepSeconds seconds, Clock::time_point start, StopSignals* signals, spdlog::logger& log) {
    checkOutputs(options);
    checkNotRead(options, guard);
    RenderSettings settings = settingsOf(options, built);
    SampleTable samples;
    if (!options.samplesFile.empty())
        settings.onSample = [&](const SampleRecord& report) { samples.add(report); };
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds, filmAovs(options));
    AovFilms aovs(options, built, log);
    aovs.addTo(settings);
    if (std::any_of(options.outputs.begin(), options.outputs.end(), isPart))
        film.keepSums();
    const OutputSettings outputSettings = outputSettingsOf(options.picture, options.threads);
    for (const auto& output : options.outputs)
        if (!isPart(output))
            film.checkWrite(output, outputSettings, aovs.develop().parts);
    const auto writeTo = [&](const std::filesystem::path& file, const Film& picture, const RenderStats& so,
                             bool finished) {
        if (isPart(file)) {
            if (finished)
                writePart(file, partOf(picture, options, built));
            return;
        }
        const DevelopedAovs developed = finished ? aovs.develop() : DevelopedAovs{};
        Metadata metadata = renderMetadata(built, options, so, seconds, finished);
        if (file.extension() == ".png")
            addViewMetadata(options.picture, metadata);
        else
            metadata.insert(metadata.end(), developed.metadata.begin(), developed.metadata.end());
        warnOfClamped(file, picture.write(file, metadata, outputSettings, developed.parts), log);
    };
    const WriteOutputs write = [&](const Film& picture, const RenderStats& so, bool finished) {
        for (const auto& output : options.outputs)
            writeTo(output, picture, so, finished);
    };
    RenderStats stats = renderPicture(built, options, settings, start, signals, film, write, log);
    const bool finished = stats.passes > 0 && !(options.takesPasses() && signals && signals->stops());
    if (!film.sums().empty()) // of earlier runs, too
        stats.total.invalidSamples =
            std::accumulate(film.sums().begin(), film.sums().end(), uint64_t(0),
                            [](uint64_t sum, const PixelAccumulator& pixel) { return sum + pixel.bad(); });
    warnOfInvalidSamples(stats, options, built, log);
    FallbackWriter rescue(log);
    for (const auto& output : options.outputs)
        rescue.write(output, [&](const auto& file) { writeTo(file, film, stats, finished); });
    if (!options.heatmapFile.empty())
        rescue.write(options.heatmapFile, [&](const auto& file) {
            writePng(file, heatmap(film, options.heatmapAov, settings.samplesPerPixel),
                     renderMetadata(built, options, stats, seconds, true));
        });
    if (!options.samplesFile.empty())
        rescue.write(options.samplesFile, [&](const auto& file) { samples.write(file); });
    if (!options.statsFile.empty())
        rescue.write(options.statsFile,
                     [&](const auto& file) { writeStats(file, built, options, stats, seconds); });
    if (!rescue.isWhole())
        return kOutputError;
    if (!finished) {
        log.warn(options.takesPasses() ? fmt::format("stopped after {} passes", stats.passes)
                                       : "stopped; --resume goes on");
        return kInterrupted;
    }
    if (options.checkpoint > 0)
        Checkpoint::remove(options);
    log.info("{}", summary(built, stats, seconds));
    for (const auto& output : options.outputs)
        log.info("wrote {}", output.string());
    return options.strict && stats.total.invalidSamples > 0 ? kInvalidSamples : kOk;
}

/// Returns the exit code.
int makeSequence(const Options& given, SceneDescription&& description, const ResourcePolicy& guard,
                 StepSeconds seconds, Diagnostics& messages, spdlog::logger& log) {
    const Sequence& sequence = *given.sequence;
    const uint64_t content = contentHash(description);
    auto start = std::chrono::steady_clock::now();
    SceneBuilder builder(std::move(description), given.build, messages);
    const Options options = withOutput(given, builder.setup().filename, log);
    if (options.pixel) // of one frame
        return printPixel(options, builder.build(shutterOf(sequence, sequence.first)),
                          settingsOf(options, builder.setup()), log);
    int code = kOk;
    const int64_t count = (int64_t(sequence.last) - sequence.first) / sequence.step + 1;
    int64_t finished = 0;
    for (int64_t i = 0; i < count; ++i) {
        const int frame = int(sequence.first + i * sequence.step);
        const Options ofFrame = optionsOfFrame(options, frame, content);
        if (!options.overwrite && isFinished(ofFrame)) {
            log.debug("frame {} is finished", frame);
            ++finished;
            continue;
        }
        releaseFreeMemory(); // of the frame before
        log.info("frame {} ({} of {})", frame, i + 1, count);
        const BuiltScene built = builder.build(shutterOf(sequence, frame));
        seconds.build = secondsSince(start);
        if (const int one = makePicture(ofFrame, built, guard, seconds, start, nullptr, log); one != kOk)
            code = one;
        if (code == kOutputError) // the next frames would fare no better
            return code;
        start = std::chrono::steady_clock::now();
        seconds.parse = 0; // once for all
    }
    log.info("{} frames: {} rendered now, {} before", count, count - finished, finished);
    return code;
}

int run(Options options, spdlog::logger& log) {
    limitMemory(options.guard);
    std::optional<StopSignals> signals; // before there are threads
    if (options.checkpoint > 0 || (options.takesPasses() && !options.sequence))
        signals.emplace();
    if (options.list) {
        fmt::print("{}", listPlugins(pluginTables()));
        return kOk;
    }
    if (options.printOcio) {
        fmt::print("{}", builtinColorConfig());
        return kOk;
    }
    checkOptions(options);
    Diagnostics messages([&](const std::string& text) { log.warn("{}", text); });
    StepSeconds seconds;
    auto start = std::chrono::steady_clock::now();
    const auto guard = std::make_shared<const ResourcePolicy>(options.guard);
    SceneDescription description = parseFiles(options.scenes, sharingNames(), messages, guard);
    seconds.parse = secondsSince(start);
    if (options.sequence)
        return makeSequence(options, std::move(description), *guard, seconds, messages, log);
    if (options.checkpoint > 0 || std::any_of(options.outputs.begin(), options.outputs.end(), isPart))
        options.content = contentHash(description);
    start = std::chrono::steady_clock::now();
    const BuiltScene built = buildScene(std::move(description), options.build, messages);
    seconds.build = secondsSince(start);
    log.debug("parsed in {:.3f} s, built in {:.3f} s", seconds.parse, seconds.build);
    if (options.pixel)
        return printPixel(options, built, settingsOf(options, built), log);
    return makePicture(withOutput(options, built.filename, log), built, *guard, seconds, processStart(),
                       signals ? &*signals : nullptr, log);
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
    MergeOptions merging;
    const bool merges = argc > 1 && std::string_view(argv[1]) == "merge";
    if (const auto code =
            merges ? parseMerge(argc - 1, argv + 1, merging) : parseCommandLine(argc, argv, options))
        return *code;
    options.quiet |= merging.quiet;
    spdlog::logger log("strobe", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
    log.set_pattern("%v");
    log.set_level(options.quiet ? spdlog::level::err : spdlog::level::from_str(options.logLevel));
    try {
        if (!merges)
            return run(options, log);
        return merge(merging, log);
    } catch (const Error& e) {
        log.error("{}", formatDiagnostic(e.location, "error", e.what()));
        return exitCodeOf(e.kind);
    } catch (const std::bad_alloc&) {
        log.error("error: out of memory{}",
                  options.guard.maxMemory > 0
                      ? fmt::format(": the scene takes more than the {} of --max-memory",
                                    formatBytes(options.guard.maxMemory))
                      : "");
        return kSceneError;
    } catch (const std::exception& e) {
        log.error("internal error: {}", e.what());
        return kInternalError;
    }
}

} // namespace
} // namespace strobe

int main(int argc, char** argv) { return strobe::guardedMain(argc, argv); }
