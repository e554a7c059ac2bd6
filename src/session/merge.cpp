#include "session/merge.h"

#include "session/options.h"
#include "session/outputs.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace strobe {

namespace {

Film filmOf(const RenderPart& part) {
    Film film(part.fullWidth, part.fullHeight, part.pixelBounds);
    const PixelBounds& w = part.pixelBounds;
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            film.add(x, y, part.sums[size_t(y - w.y0) * size_t(w.width()) + size_t(x - w.x0)]);
    return film;
}

uint64_t invalidSamplesOf(const RenderPart& part) {
    uint64_t bad = 0;
    for (const PixelAccumulator& sum : part.sums)
        bad += sum.invalidCount();
    return bad;
}

Metadata metadataOf(const RenderPart& part, uint64_t missing) {
    Metadata m;
    for (const auto& [name, value] : part.key)
        m.emplace_back("strobe:" + name, value);
    m.emplace_back("Software", "strobe " STROBE_VERSION);
    m.emplace_back("strobe:samplesPerPixel", part.samplesPerPixel);
    m.emplace_back("strobe:invalidSamples", std::to_string(invalidSamplesOf(part)));
    if (missing > 0)
        m.emplace_back("strobe:unfinished", 1);
    return m;
}

/// How many samples are missing. What parts at the frame's border lack cannot be told from a crop: only the
/// picture's size is said, where there is one.
uint64_t warnOfMissing(const RenderPart& whole, const std::vector<std::filesystem::path>& outputs,
                       spdlog::logger& log) {
    const PixelBounds& w = whole.pixelBounds;
    const uint64_t missing = missingSamples(whole);
    if (missing > 0)
        log.warn("{} samples of the pixels from {},{} to {},{} are missing", missing, w.x0, w.y0, w.x1 - 1,
                 w.y1 - 1);
    const bool isWhole = w.width() == whole.fullWidth && w.height() == whole.fullHeight;
    if (!isWhole && !std::all_of(outputs.begin(), outputs.end(), isPart))
        log.warn("the parts show pixels {},{} to {},{} of a frame of {}x{}", w.x0, w.y0, w.x1 - 1, w.y1 - 1,
                 whole.fullWidth, whole.fullHeight);
    return missing;
}

void writePicture(const std::filesystem::path& output, const RenderPart& whole, Metadata metadata,
                  const PictureOptions& options, const OutputSettings& settings, spdlog::logger& log) {
    if (output.extension() == ".png")
        addViewMetadata(options, metadata);
    warnOfClamped(output, filmOf(whole).write(output, metadata, settings), log);
}

} // namespace

std::optional<int> parseMerge(int argc, char** argv, MergeOptions& options) {
    CLI::App app{"strobe merge: puts the parts of a render together"};
    app.add_option("PART", options.parts, "files that strobe -o NAME.part wrote")->required();
    app.add_option("-o,--output", options.outputs, "output file (.exr, .png or .part); may be given again")
        ->allow_extra_args(false)
        ->required();
    addPictureOptions(app, options.picture);
    app.add_flag("--strict", options.strict, "fail (exit code 6) if a sample is NaN, infinite or too large");
    app.add_flag("--quiet", options.quiet, "print errors only");
    try {
        app.parse(argc, argv);
        for (const auto& output : options.outputs)
            checkOutputName(output);
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? kOk : kUsageError;
    }
    return std::nullopt;
}

int merge(const MergeOptions& options, spdlog::logger& log) {
    checkOutputs(options.outputs);
    const OutputSettings settings = outputSettingsOf(options.picture, 0);
    RenderPart whole = readPart(options.parts.front());
    for (size_t i = 1; i < options.parts.size(); ++i)
        addPart(whole, readPart(options.parts[i]), options.parts[i]);
    const uint64_t missing = warnOfMissing(whole, options.outputs, log);
    for (const auto& output : options.outputs) {
        if (isPart(output))
            writePart(output, whole);
        else
            writePicture(output, whole, metadataOf(whole, missing), options.picture, settings, log);
        log.info("wrote {}", output.string());
    }
    const uint64_t bad = invalidSamplesOf(whole);
    if (bad > 0)
        log.log(options.strict ? spdlog::level::err : spdlog::level::warn,
                "{} samples were NaN, infinite or beyond 2.8e14 and are left out", bad);
    return options.strict && bad > 0 ? kInvalidSamples : kOk;
}

} // namespace strobe
