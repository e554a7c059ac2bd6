#include "cli/progressive_options.h"

#include "cli/option_validators.h"

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

void addGoalOptions(CLI::App& app, ProgressiveOptions& options) {
    app.add_option("--time-limit", options.timeLimit,
                   "render as many samples as fit into this many seconds, from program start to exit")
        ->transform(numberAboveZero<double>());
    app.add_option("--noise-target", options.noiseTarget,
                   "render passes of --spp samples until the noise of 95 % of the pixels is at most this")
        ->transform(numberAboveZero<double>());
    app.add_option("--reference", options.reference, "print the error against this image while rendering");
    app.add_option("--curve", options.errorCurve, "with --reference: write errors and seconds as CSV");
}

void addViewOptions(CLI::App& app, ProgressiveOptions& options) {
    app.add_option("--write-interval", options.writeInterval,
                   "write the unfinished image every so many seconds")
        ->transform(numberAboveZero<double>());
    app.add_option_function<std::string>(
        "--display-server", [&options](const std::string& text) { options.viewer = parseAddress(text); },
        "host:port: show the image in tev while it is rendered");
}

} // namespace

void addProgressiveOptions(CLI::App& app, RenderOptions& options) {
    ProgressiveOptions& progressive = options.progressive;
    addGoalOptions(app, progressive);
    addViewOptions(app, progressive);
    app.add_option_function<std::vector<int>>(
           "--pixel-bounds",
           [&options](const std::vector<int>& bounds) { options.build.pixelBounds = parseBounds(bounds); },
           "x0 x1 y0 y1: region of the frame to render, in pixels")
        ->expected(4);
    app.add_option_function<std::string>(
        "--sample-range", [&options](const std::string& text) { options.sampleRange = parseSlice(text); },
        "first:end: samples of each pixel to render, for strobe merge");
    app.add_option("--checkpoint", progressive.checkpointInterval,
                   "save the finished pixels every so many seconds, and when a signal ends the render")
        ->transform(numberAboveZero<double>());
    app.add_flag("--resume", progressive.resume,
                 "with --checkpoint: continue from the checkpoint, if there is one");
}

} // namespace strobe
