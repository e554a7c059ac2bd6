#include "core/util/standard_files.h"
#include "core/util/version.h"
#include "loader/build/plugin_tables.h"
#include "session/aov_recorder.h"
#include "session/files/part_file.h"
#include "session/outputs.h"
#include "session/session.h"

namespace strobe {

namespace {

Metadata metadataOf(const RenderPart& part, uint64_t missing) {
    Metadata m;
    for (const auto& [name, value] : part.key)
        m.emplace_back("strobe:" + name, value);
    m.emplace_back("Software", std::string("strobe ") + version());
    m.emplace_back("strobe:samplesPerPixel", part.samplesPerPixel);
    m.emplace_back("strobe:invalidSamples", std::to_string(invalidSamples(part.sums)));
    if (missing > 0)
        m.emplace_back("strobe:unfinished", 1);
    return m;
}

/// Warns of missing samples, and returns their number. A part does not say whether it is of a crop, so pixels
/// outside of its bounds are not missing: of images, a warning gives the pixels that they show.
uint64_t warnOfMissing(const RenderPart& merged, const std::vector<std::filesystem::path>& images,
                       const Log& log) {
    const PixelBounds& bounds = merged.pixelBounds;
    const uint64_t missing = missingSamples(merged);
    if (missing > 0)
        log.warn("{} samples of the pixels from {},{} to {},{} are missing", missing, bounds.x0, bounds.y0,
                 bounds.x1 - 1, bounds.y1 - 1);
    const bool isWholeFrame = bounds.width() == merged.fullWidth && bounds.height() == merged.fullHeight;
    if (!isWholeFrame && !std::all_of(images.begin(), images.end(), isPart))
        log.warn("the parts show pixels {},{} to {},{} of a frame of {}x{}", bounds.x0, bounds.y0,
                 bounds.x1 - 1, bounds.y1 - 1, merged.fullWidth, merged.fullHeight);
    return missing;
}

/// Returns the image, completed by the integrator that rendered the parts.
Film filmOf(const RenderPart& merged, const PluginLibraries& plugins) {
    Film film(merged.fullWidth, merged.fullHeight, merged.pixelBounds);
    addToFilm(merged, film);
    if (film.records().isEmpty())
        return film;
    const PluginTables tables = pluginTables(plugins);
    Diagnostics diagnostics;
    findPlugin(tables.integrators, merged.keyValue("integrator"), "integrator", {})
        .create(ParamSet(), BuildContext{diagnostics})
        ->finishMerged(film);
    return film;
}

void writeImage(const std::filesystem::path& image, const Film& film, const RecordedAovs& aovs,
                Metadata metadata, const ImageOptions& format, const OutputSettings& settings,
                const Log& log) {
    if (imageFormatOf(image) != ImageFormat::Exr)
        addViewMetadata(format, metadata);
    else
        metadata.insert(metadata.end(), aovs.metadata.begin(), aovs.metadata.end());
    warnOfClampedValues(image, film.write(image, metadata, settings, aovs.parts, aovs.alpha), log);
}

} // namespace

Outcome mergeParts(const MergeOptions& options, const Log& log) {
    checkOptions(options);
    checkOutputFiles(options.images, options.makeFolders);
    checkOutputsAreNotInputs(options);
    const OutputSettings settings = outputSettings(options.format, 0);
    RenderPart merged = readPart(options.parts.front());
    for (size_t i = 1; i < options.parts.size(); ++i)
        addPart(merged, readPart(options.parts[i]), options.parts[i]);
    const uint64_t missing = warnOfMissing(merged, options.images, log);
    std::optional<Film> film;
    for (const auto& image : options.images) {
        if (isPart(image)) {
            writePart(image, merged);
        } else {
            if (!film)
                film = filmOf(merged, *options.plugins);
            writeImage(image, *film, recordedAovs(merged.layout, *film), metadataOf(merged, missing),
                       options.format, settings, log);
        }
        if (!isStandardStream(image))
            log.info("wrote {}", image.string());
    }
    const uint64_t invalid = invalidSamples(merged.sums);
    if (invalid > 0)
        log.write(options.strict ? LogLevel::Error : LogLevel::Warning,
                  "{} samples were NaN, infinite or beyond 2.8e14 and are left out", invalid);
    return options.strict && invalid > 0 ? Outcome::InvalidSamples : Outcome::Finished;
}

} // namespace strobe
