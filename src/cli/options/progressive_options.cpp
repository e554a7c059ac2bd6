#include "cli/options/progressive_options.h"

#include "cli/options/option_validators.h"

namespace strobe {

namespace {

ViewerAddress parseAddress(const std::string& text) {
    const auto address = ViewerAddress::parse(text);
    if (!address)
        throw CLI::ValidationError("--display-server", "takes host:port");
    return *address;
}

PixelBounds parseBounds(const std::vector<int>& b) {
    if (b[0] >= b[1] || b[2] >= b[3])
        throw CLI::ValidationError("--pixel-bounds", "takes x0 x1 y0 y1 with x0 < x1 and y0 < y1");
    return {b[0], b[2], b[1], b[3]};
}

SampleSlice parseSlice(const std::string& text) {
    SampleSlice slice;
    char rest = 0;
    if (text.find('-') != std::string::npos ||
        std::sscanf(text.c_str(), "%u:%u%c", &slice.first, &slice.end, &rest) != 2)
        throw CLI::ValidationError("--sample-range", "takes first:end, two integers");
    return slice;
}

FrameSlice parseFrameSlice(const std::string& text) {
    FrameSlice slice;
    char rest = 0;
    if (text.find('-') != std::string::npos ||
        std::sscanf(text.c_str(), "%u/%u%c", &slice.number, &slice.count, &rest) != 2)
        throw CLI::ValidationError("--slice", "takes i/n, two integers");
    --slice.number; // of 0, the range check fails
    return slice;
}

void addGoalOptions(CLI::App& app, ProgressiveOptions& options) {
    app.option_defaults()->group("Progressive rendering");
    app.add_option("--time-limit", options.timeLimit,
                   "render as many samples as fit into this time, from program start to exit")
        ->type_name("SECONDS")
        ->transform(numberAboveZero<double>());
    app.add_option("--noise-target", options.noiseTarget,
                   "render passes of --spp samples until the noise of 95 % of the pixels is at most E")
        ->type_name("E")
        ->transform(numberAboveZero<double>());
    app.add_option("--reference", options.reference, "print the error against this image while rendering")
        ->type_name("FILE");
    app.add_option("--curve", options.errorCurve,
                   "with --reference: write errors and seconds to this CSV file")
        ->type_name("FILE");
}

void addViewOptions(CLI::App& app, ProgressiveOptions& options) {
    app.add_option("--write-interval", options.writeInterval, "write the unfinished image at this interval")
        ->type_name("SECONDS")
        ->transform(numberAboveZero<double>());
    app.add_option_function<std::string>(
           "--display-server", [&options](const std::string& text) { options.viewer = parseAddress(text); },
           "show the image in tev while it is rendered")
        ->type_name("HOST:PORT");
}

} // namespace

void addProgressiveOptions(CLI::App& app, RenderOptions& options) {
    ProgressiveOptions& progressive = options.progressive;
    addGoalOptions(app, progressive);
    addViewOptions(app, progressive);
    app.option_defaults()->group("Parts and checkpoints");
    app.add_option_function<std::vector<int>>(
           "--pixel-bounds",
           [&options](const std::vector<int>& bounds) { options.build.pixelBounds = parseBounds(bounds); },
           "region of the frame to render, in pixels; X1 and Y1 are excluded")
        ->type_name("X0 X1 Y0 Y1")
        ->expected(4)
        ->allow_extra_args(false);
    app.add_option_function<std::string>(
           "--sample-range", [&options](const std::string& text) { options.sampleRange = parseSlice(text); },
           "render samples A ... B-1 of each pixel, for strobe merge")
        ->type_name("A:B");
    app.add_option_function<std::string>(
           "--slice", [&options](const std::string& text) { options.slice = parseFrameSlice(text); },
           "render slice I of N, of about equal cost, for strobe merge; counted from 1")
        ->type_name("I/N");
    app.add_option("--checkpoint", progressive.checkpointInterval,
                   "save the finished pixels at this interval, and when a signal ends the render")
        ->type_name("SECONDS")
        ->transform(numberAboveZero<double>());
    app.add_flag("--resume", progressive.resume,
                 "with --checkpoint: continue from the checkpoint, if there is one");
}

} // namespace strobe
