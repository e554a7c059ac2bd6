// The command line.
#pragma once

#include "core/math/math.h"
#include "core/render/aov_film.h"
#include "core/render/light_film.h"
#include "core/util/resource_policy.h"
#include "display/display_server.h"
#include "loader/build/builder.h"
#include "session/output_options.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace strobe {

/// Frames first, first + step, … up to last; frame f has its shutter open from (f + open) / fps to
/// (f + close) / fps in scene time.
struct Sequence {
    int first = 0, last = 0, step = 1;
    double fps = 24, open = 0, close = 0.5;
};

struct Options {
    std::vector<std::filesystem::path> scenes;
    std::vector<std::filesystem::path> outputs;
    BuildOptions build;
    int threads = 0;
    int tile = 32;
    uint64_t seed = 0;
    std::optional<V2i> pixel;
    std::optional<uint32_t> sample;
    std::filesystem::path statsFile, heatmapFile, samplesFile;
    double timeLimit = 0, noiseTarget = 0, partial = 0, checkpoint = 0; ///< 0: none
    bool resume = false;
    ResourcePolicy::Settings guard; ///< what scenes may read and take
    bool strict = false;            ///< samples that are no numbers are a failure
    float clamp = 0;                ///< see RenderSettings::clamp
    std::filesystem::path reference, curveFile;
    std::optional<SampleSlice> samples; ///< of each pixel; none: all
    uint64_t content = 0;               ///< contentHash of the scene, where parts are written
    std::optional<ViewerAddress> display;
    Aov heatmapAov = Aov::Shades;
    PictureOptions picture;
    std::vector<Aov> aovs; ///< of EXR outputs
    int cryptoLevels = 6;
    std::string logLevel = "info";
    bool quiet = false;
    bool list = false, printOcio = false;
    std::optional<Sequence> sequence;
    bool overwrite = false;   ///< render finished frames of a sequence again
    std::string command;      ///< the options that decide a picture, as they were given
    std::optional<int> frame; ///< of a sequence, when these are the options of one
    std::string frameKey;     ///< likewise; see optionsOfFrame

    /// Whether it is rendered again and again, until time is up or the picture is good.
    bool takesPasses() const { return timeLimit > 0 || noiseTarget > 0; }
};

/// Exit codes of the program.
enum ExitCode {
    kOk = 0,
    kUsageError = 1,
    kSceneError = 2,
    kOutputError = 3,
    kInternalError = 4,
    kInterrupted = 5,
    kInvalidSamples = 6
};

/// Throws CLI::ValidationError unless the name is that of a file that can be written: .exr, .png or .part.
void checkOutputName(const std::filesystem::path& output);

/// Fills `options`; returns an exit code when the program has nothing more to do (--help, --version, a
/// mistake).
std::optional<int> parseCommandLine(int argc, char** argv, Options& options);

} // namespace strobe
