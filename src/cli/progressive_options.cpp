#include "cli/progressive_options.h"

#include "cli/option_validators.h"

namespace strobe {

namespace {

/// An option, and whether it was given.
using Given = std::pair<std::string, bool>;

/// Throws where one of `some` and one of `others` are given.
void keepApart(std::initializer_list<Given> some, std::initializer_list<Given> others) {
    for (const auto& [one, isGiven] : some)
        for (const auto& [other, otherIsGiven] : others)
            if (isGiven && otherIsGiven)
                throw CLI::ValidationError(other, "does not go with " + one);
}

void need(const Given& option, const Given& other) {
    if (option.second && !other.second)
        throw CLI::ValidationError(option.first, "needs " + other.first);
}

template <class T>
bool isOneOf(const std::vector<T>& values, const T& value) {
    return std::find(values.begin(), values.end(), value) != values.end();
}

/// The first AOV other than the variance, by the name that --aov knows; empty: there is none.
std::string firstAov(const Options& o) {
    for (const AovInfo& row : aovTable())
        if (row.aov != Aov::Variance && isOneOf(o.aovs, row.aov))
            return row.name;
    return {};
}

/// A pixel is printed, and nothing is written or shown.
void checkPixel(const Options& o, const Given& pixel, std::initializer_list<Given> others) {
    keepApart({pixel}, {{"-o", !o.outputs.empty()},
                        {"--stats", !o.statsFile.empty()},
                        {"--partial", o.partial > 0},
                        {"--display-server", o.display.has_value()}});
    keepApart({pixel}, others);
}

void checkTogether(const Options& o) {
    const Given time{"--time-limit", o.timeLimit > 0}, noise{"--noise-target", o.noiseTarget > 0};
    const Given reference{"--reference", !o.reference.empty()}, checkpoint{"--checkpoint", o.checkpoint > 0};
    const Given slice{"--sample-range", o.samples.has_value()};
    const Given parts{"-o *.part", std::any_of(o.outputs.begin(), o.outputs.end(), [](const auto& output) {
                          return output.extension() == ".part";
                      })};
    const Given pixel{"--pixel", o.pixel.has_value()}, table{"--samples", !o.samplesFile.empty()};
    const Given variance{"--aov variance", isOneOf(o.aovs, Aov::Variance)};
    const std::string layer = firstAov(o);
    const Given layers{"--aov " + layer, !layer.empty()};
    const Given heatmap{"--heatmap", !o.heatmapFile.empty()};
    const Given frames{"--frames", o.sequence.has_value()};
    keepApart({time, noise, reference}, {pixel, table, layers, heatmap, slice, checkpoint});
    keepApart({time, noise}, {parts});
    keepApart({slice, parts, checkpoint}, {layers, variance, heatmap, frames, pixel});
    keepApart({checkpoint}, {table});
    need(variance, noise); // passes tell it
    need({"--curve", !o.curveFile.empty()}, reference);
    need({"--resume", o.resume}, checkpoint);
    checkPixel(o, pixel, {layers, heatmap, table});
}

PixelBounds readBounds(const std::vector<int>& b) {
    if (b[0] >= b[1] || b[2] >= b[3])
        throw CLI::ValidationError("--pixel-bounds", "takes x0 x1 y0 y1 with x0 < x1 and y0 < y1");
    return {b[0], b[2], b[1], b[3]};
}

SampleSlice readSlice(const std::string& text) {
    SampleSlice slice;
    char rest = 0;
    if (text.find('-') != std::string::npos ||
        std::sscanf(text.c_str(), "%u:%u%c", &slice.first, &slice.end, &rest) != 2)
        throw CLI::ValidationError("--sample-range", "takes first:end, two integers");
    return slice;
}

} // namespace

void addProgressiveOptions(CLI::App& app, Options& options, ProgressiveTexts& texts) {
    app.add_option("--time-limit", options.timeLimit,
                   "render as well as these many seconds allow, all counted")
        ->transform(numberAboveZero<double>());
    app.add_option("--noise-target", options.noiseTarget,
                   "render until the noise of 95 % of the pixels is no more; passes of --spp samples")
        ->transform(numberAboveZero<double>());
    app.add_option("--reference", options.reference, "print the error against this image while rendering");
    app.add_option("--curve", options.curveFile, "with --reference: write errors and seconds as CSV");
    app.add_option("--partial", options.partial, "write the image so far every so many seconds")
        ->transform(numberAboveZero<double>());
    app.add_option("--display-server", texts.display,
                   "host:port: show the picture in tev while it is rendered");
    app.add_option("--pixel-bounds", texts.bounds, "x0 x1 y0 y1: part of the frame, pixels")->expected(4);
    app.add_option("--sample-range", texts.samples, "first:end: of each pixel's samples, for strobe merge");
    app.add_option("--checkpoint", options.checkpoint,
                   "save the finished part every so many seconds, and when a signal ends the render")
        ->transform(numberAboveZero<double>());
    app.add_flag("--resume", options.resume, "with --checkpoint: go on from what was saved");
}

void readProgressiveOptions(const ProgressiveTexts& texts, Options& options) {
    if (texts.display && !(options.display = ViewerAddress::parse(*texts.display)))
        throw CLI::ValidationError("--display-server", "takes host:port");
    keepApart({{"--crop", options.build.crop.has_value()}}, {{"--pixel-bounds", !texts.bounds.empty()}});
    if (!texts.bounds.empty())
        options.build.pixelBounds = readBounds(texts.bounds);
    if (texts.samples)
        options.samples = readSlice(*texts.samples);
    checkTogether(options);
}

} // namespace strobe
