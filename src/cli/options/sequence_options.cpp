#include "cli/options/sequence_options.h"

#include "cli/options/option_validators.h"
#include "core/util/version.h"

#include <fmt/format.h>

#include <charconv>
#include <set>

namespace strobe {

namespace {

constexpr size_t kMaxFrames = 10'000'000;

/// Removes an integer from the front of the text; none if there is none.
std::optional<int> takeInteger(std::string_view& text) {
    int number = 0;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc())
        return std::nullopt;
    text.remove_prefix(size_t(rest - text.data()));
    return number;
}

/// Appends the frames of "7", "5-9", "5:9" or "5:9:2". Returns false if the text is none of them.
bool addFrames(std::string_view text, std::vector<int>& frames) {
    const std::optional<int> first = takeInteger(text);
    std::optional<int> last = first, step = 1;
    if (!text.empty() && (text[0] == ':' || text[0] == '-')) {
        const bool mayHaveStep = text[0] == ':';
        text.remove_prefix(1);
        last = takeInteger(text);
        if (mayHaveStep && !text.empty() && text[0] == ':') {
            text.remove_prefix(1);
            step = takeInteger(text);
        }
    }
    if (!first || !last || !step || !text.empty() || *first > *last || *step <= 0)
        return false;
    for (int64_t frame = *first; frame <= *last; frame += *step) {
        if (frames.size() == kMaxFrames)
            throw CLI::ValidationError("--frames", fmt::format("at most {} frames", kMaxFrames));
        frames.push_back(int(frame));
    }
    return true;
}

/// Parses entries of addFrames, separated by commas. A frame that is named twice is rendered once.
std::vector<int> parseFrames(const std::string& text) {
    std::vector<int> frames;
    std::string entry;
    for (std::istringstream entries(text + ','); std::getline(entries, entry, ',');)
        if (!addFrames(entry, frames))
            throw CLI::ValidationError("--frames", "takes frames such as 7, 5-9, 1:9:2 (first:last:step) or "
                                                   "1,3,5-9, integers in ascending order");
    std::set<int> seen;
    std::erase_if(frames, [&](int frame) { return !seen.insert(frame).second; });
    return frames;
}

/// Parses "open,close" in frames.
void parseShutter(const std::string& text, SequenceOptions& sequence) {
    double& open = sequence.shutterOpen;
    double& close = sequence.shutterClose;
    char rest = 0;
    if (std::sscanf(text.c_str(), "%lf,%lf%c", &open, &close, &rest) != 2 || !std::isfinite(open) ||
        !std::isfinite(close) || open > close)
        throw CLI::ValidationError("--shutter", "takes open,close, two numbers in ascending order");
}

/// Returns a text of the version of strobe, and of all given options that affect the image.
std::string imageAffectingOptions(const CLI::App& app) {
    static const std::set<std::string> kOthers{
        "FILE",        "--output",     "--threads",   "--tile",       "--quiet",          "--frames",
        "--overwrite", "--stats",      "--log-level", "--samples",    "--write-interval", "--display-server",
        "--reference", "--curve",      "--sandbox",   "--max-memory", "--mkdir",          "--no-output",
        "--slice",     "--checkpoint", "--resume",    "--dry-run",    "--expect",         "--texture-mb",
        "--strict"};
    std::string text = std::string("strobe ") + version() + "\n";
    for (const CLI::Option* option : app.get_options())
        if (!kOthers.count(option->get_name()))
            for (const std::string& value : option->results())
                text += option->get_name() + "=" + value + "\n";
    return text;
}

} // namespace

void addSequenceOptions(CLI::App& app, SequenceOptions& sequence) {
    app.option_defaults()->group("Sequences");
    app.add_option_function<std::string>(
           "--frames", [&sequence](const std::string& text) { sequence.frames = parseFrames(text); },
           "render frames to numbered files: 7, 5-9, 1:9:2 (first:last:step), or several, as 1,3,5-9")
        ->type_name("LIST");
    app.add_option("--fps", sequence.fps, "frames per unit of scene time [24]")
        ->type_name("F")
        ->transform(numberAboveZero<double>());
    app.add_option_function<std::string>(
           "--shutter", [&sequence](const std::string& text) { parseShutter(text, sequence); },
           "times, in frames from the start of the frame, at which the shutter opens and closes [0,0.5]")
        ->type_name("OPEN,CLOSE");
    app.add_flag("--overwrite", sequence.overwrite, "render finished frames again");
}

void readSequenceOptions(const CLI::App& app, const SequenceOptions& sequence, RenderOptions& options) {
    if (app.count("--frames") == 0) {
        for (const char* name : {"--fps", "--shutter", "--overwrite"})
            if (app.count(name) > 0)
                throw CLI::ValidationError(name, "needs --frames");
        return;
    }
    options.sequence = sequence;
    options.sequence->settings = imageAffectingOptions(app);
}

} // namespace strobe
