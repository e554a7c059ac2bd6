#include "cli/sequence_options.h"

#include "cli/option_validators.h"
#include "core/util/version.h"

#include <charconv>
#include <set>

namespace strobe {

namespace {

/// Parses "first", "first:last" or "first:last:step".
void parseFrames(const std::string& text, SequenceOptions& sequence) {
    std::vector<int> numbers;
    const char* position = text.data();
    const char* const end = position + text.size();
    while (numbers.size() < 3) {
        int number = 0;
        const auto [rest, error] = std::from_chars(position, end, number);
        if (error != std::errc())
            break;
        numbers.push_back(number);
        position = rest;
        if (position == end || *position != ':' || position + 1 == end || numbers.size() == 3)
            break;
        ++position;
    }
    if (!numbers.empty()) {
        sequence.first = numbers[0];
        sequence.last = numbers.size() > 1 ? numbers[1] : numbers[0];
        sequence.step = numbers.size() > 2 ? numbers[2] : 1;
    }
    if (numbers.empty() || position != end || sequence.first > sequence.last || sequence.step <= 0)
        throw CLI::ValidationError("--frames",
                                   "takes first:last or first:last:step, integers in ascending order");
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

/// Returns a text of the version of strobe, of $OCIO, and of all given options that affect the image.
std::string imageAffectingOptions(const CLI::App& app) {
    static const std::set<std::string> kOthers{
        "FILE",        "--output", "--threads",   "--tile",      "--quiet",          "--frames",
        "--overwrite", "--stats",  "--log-level", "--samples",   "--write-interval", "--display-server",
        "--reference", "--curve",  "--sandbox",   "--max-memory"};
    std::string text = std::string("strobe ") + version() + "\n";
    for (const CLI::Option* option : app.get_options())
        if (!kOthers.count(option->get_name()))
            for (const std::string& value : option->results())
                text += option->get_name() + "=" + value + "\n";
    if (const char* config = std::getenv("OCIO"))
        text += std::string("OCIO=") + config + "\n";
    return text;
}

} // namespace

void addSequenceOptions(CLI::App& app, SequenceOptions& sequence) {
    app.option_defaults()->group("Sequences");
    app.add_option_function<std::string>(
           "--frames", [&sequence](const std::string& text) { parseFrames(text, sequence); },
           "render frames A, A+S, ... up to B to numbered files; step 1 if S is not given")
        ->type_name("A:B[:S]");
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
