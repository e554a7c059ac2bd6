// The program strobe: parses the command line, calls the session library, and returns an exit code.
#include "cli/command_line.h"
#include "cli/merge_command_line.h"
#include "cli/options/resource_options.h"
#include "cli/process_start.h"
#include "cli/progress.h"
#include "cli/standard_streams.h"
#include "cli/stop_signals.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace strobe {
namespace {

spdlog::level::level_enum toSpdlog(LogLevel level) {
    switch (level) {
    case LogLevel::Debug:
        return spdlog::level::debug;
    case LogLevel::Info:
        return spdlog::level::info;
    case LogLevel::Warning:
        return spdlog::level::warn;
    case LogLevel::Error:
        return spdlog::level::err;
    }
    return spdlog::level::err;
}

/// Returns a log to standard error. `level`: debug, info, warn or error.
Log consoleLog(const std::string& level) {
    const auto logger =
        std::make_shared<spdlog::logger>("strobe", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
    logger->set_pattern("%v");
    logger->set_level(spdlog::level::from_str(level));
    return {[logger](LogLevel severity, const std::string& text) {
        logger->log(toSpdlog(severity), "{}", text);
    }};
}

ExitCode exitCodeOf(Outcome outcome) {
    switch (outcome) {
    case Outcome::Finished:
        return kOk;
    case Outcome::InvalidSamples:
        return kInvalidSamples;
    case Outcome::OutputFailed:
        return kOutputError;
    case Outcome::Interrupted:
        return kInterrupted;
    }
    return kInternalError;
}

ExitCode exitCodeOf(ErrorKind kind) {
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

/// Calls `run`, which returns an exit code; logs what it throws. `maxMemory`: bytes; 0: no limit.
template <class Run>
ExitCode runGuarded(const Log& log, uint64_t maxMemory, const Run& run) {
    try {
        return run();
    } catch (const Error& e) {
        log.error("{}", formatDiagnostic(e.location, "error", e.what()));
        return exitCodeOf(e.kind);
    } catch (const std::bad_alloc&) {
        log.error("error: out of memory{}",
                  maxMemory > 0
                      ? fmt::format(": the scene and its render take more than the {} of --max-memory",
                                    formatBytes(maxMemory))
                      : "");
        return kSceneError;
    } catch (const std::system_error& e) { // of std::thread
        log.error("error: the system refuses more threads, or other resources: {}", e.what());
        return kSceneError;
    } catch (const std::exception& e) {
        log.error("internal error: {}", e.what());
        return kInternalError;
    }
}

ExitCode printPixel(const CommandLine& line, const Log& log) {
    const PixelQuery& query = *line.pixel;
    const auto [value, invalidSamples] = renderPixel(line.render, query, log);
    const std::string sample = query.sample ? fmt::format(" sample {}", *query.sample) : "";
    printResult(fmt::format("pixel {},{}{}: {:.9g} {:.9g} {:.9g}\n", query.pixel.x, query.pixel.y, sample,
                            value.x, value.y, value.z));
    return line.render.strict && invalidSamples > 0 ? kInvalidSamples : kOk;
}

/// Renders with progress on standard error. Signals stop renders that have something to save: checkpoints or
/// passes. They end other renders and sequences.
ExitCode renderWithProgress(const CommandLine& line, const Log& log) {
    const ProgressiveOptions& progressive = line.render.progressive;
    Progress progress;
    RenderControl control;
    RenderCallbacks callbacks;
    if (!line.quiet) {
        callbacks.onProgress = [&](double fraction) { progress.update(fraction); };
        callbacks.onRendered = [&] { progress.finish(); };
    }
    callbacks.control = &control;
    const bool canSave =
        progressive.checkpointInterval > 0 || (progressive.takesPasses() && !line.render.sequence);
    const StopSignals signals(control, canSave);
    return exitCodeOf(renderScene(line.render, log, callbacks));
}

void logWarnings(const std::vector<std::string>& warnings, const Log& log) {
    for (const std::string& warning : warnings)
        log.warn("{}", warning);
}

ExitCode run(const CommandLine& line, const Log& log) {
    logWarnings(line.warnings, log);
    limitMemory(line.render.resources);
    if (line.list) {
        const PluginTables tables = pluginTables(*line.render.build.plugins);
        printResult(line.listName.empty() ? listPlugins(tables) + listAovs()
                                          : listPlugins(tables, line.listName));
        return kOk;
    }
    if (!line.text.empty()) {
        printResult(line.text);
        return kOk;
    }
    if (line.printOcio) {
        printResult(kBuiltinColorConfig);
        return kOk;
    }
    return line.pixel ? printPixel(line, log) : renderWithProgress(line, log);
}

/// Calls `parse`, which prints the help on request, and logs what it throws.
std::optional<ExitCode> parseGuarded(const std::function<std::optional<ExitCode>()>& parse) {
    std::optional<ExitCode> result;
    const ExitCode code = runGuarded(consoleLog("error"), 0, [&] {
        result = parse();
        return kOk;
    });
    return code == kOk ? result : code;
}

ExitCode mergeMain(int argc, char** argv) {
    MergeCommandLine line;
    if (const auto code = parseGuarded([&] { return parseMergeCommandLine(argc, argv, line); }))
        return *code;
    const Log log = consoleLog(line.quiet ? "error" : "info");
    logWarnings(line.warnings, log);
    return runGuarded(log, 0, [&] { return exitCodeOf(mergeParts(line.merge, log)); });
}

ExitCode renderMain(int argc, char** argv) {
    CommandLine line;
    if (const auto code = parseGuarded([&] { return parseCommandLine(argc, argv, line); }))
        return *code;
    line.render.progressive.start = processStart();
    const Log log = consoleLog(line.quiet ? "error" : line.logLevel);
    return runGuarded(log, line.render.resources.maxMemory, [&] { return run(line, log); });
}

} // namespace
} // namespace strobe

int main(int argc, char** argv) {
    strobe::prepareStandardStreams();
    const bool isMerge = argc > 1 && std::string_view(argv[1]) == "merge";
    return isMerge ? strobe::mergeMain(argc - 1, argv + 1) : strobe::renderMain(argc, argv);
}
