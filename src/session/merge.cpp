#include "core/util/memory.h"
#include "core/util/standard_files.h"
#include "core/util/version.h"
#include "loader/build/plugin_tables.h"
#include "session/aov_recorder.h"
#include "session/files/merged_frame.h"
#include "session/files/part_list.h"
#include "session/outputs.h"
#include "session/session.h"

namespace strobe {

namespace {

/// A call of mergeParts.
class Merge {
  public:
    /// Reads the headers of the parts.
    Merge(const MergeOptions& options, const Log& log)
        : m_options(options), m_log(log), m_settings(outputSettings(options.format, 0)),
          m_parts(options.parts, options.allowMissing) {
        const bool writesImage = std::any_of(options.images.begin(), options.images.end(),
                                             [](auto& image) { return !isPart(image); });
        if (writesImage)
            checkSlices();
    }

    Outcome run() {
        checkMemory();
        MergedFrame frame(m_parts.merged());
        for (const auto& file : m_parts.files()) {
            PartReader part(file);
            frame.add(part);
            if (m_parts.hasSlicesOfSamples() && !frame.film().records().isEmpty())
                integrator()->mergeRecords(frame.film().records());
        }
        for (const auto& image : m_options.images) // before the integrator completes the image
            if (isPart(image)) {
                frame.writePart(image);
                m_log.info("wrote {}", image.string());
            }
        writeImages(frame);
        return reportInvalidSamples(frame.film());
    }

  private:
    /// Returns the integrator that rendered the parts.
    std::shared_ptr<const Integrator> integrator() const {
        const PluginTables tables = pluginTables(*m_options.plugins);
        Diagnostics diagnostics;
        return findPlugin(tables.integrators, m_parts.merged().keyValue("integrator"), "integrator", {})
            .create(ParamSet(), BuildContext{diagnostics});
    }

    /// Throws Error of kind Usage if this machine has too little memory for the frame, whose size may be
    /// wrong in a damaged part.
    void checkMemory() const {
        const PartHeader& merged = m_parts.merged();
        const uint64_t pixels = uint64_t(merged.pixelBounds.width()) * uint64_t(merged.pixelBounds.height());
        if (pixels * (sizeof(PixelAccumulator) + sizeof(Rgb)) > physicalMemory())
            throw Error(fmt::format("a frame of {}x{} pixels takes more memory than this machine has",
                                    merged.fullWidth, merged.fullHeight),
                        ErrorKind::Usage);
    }

    /// Warns of what is missing, or throws Error of kind Usage.
    void reportMissing(const std::string& text) const {
        if (!m_options.allowMissing)
            throw Error(text + "; --allow-missing writes what there is", ErrorKind::Usage);
        m_log.warn("{}", text);
    }

    /// Reports missing files and slices.
    void checkSlices() const {
        const auto& absent = m_parts.absent();
        if (const std::string missing = missingSlices(m_parts.merged()); !missing.empty())
            reportMissing(missing);
        else if (!absent.empty())
            m_log.warn("{} of {} parts do not exist, as {}", absent.size(), m_options.parts.size(),
                       absent.front().string());
    }

    /// Reports missing samples. A part does not say whether it is of a crop, so pixels outside of its bounds
    /// are not missing: a warning gives the pixels that the images show. Returns the number of samples.
    uint64_t checkSamples(const MergedFrame& frame) const {
        const PartHeader& merged = m_parts.merged();
        const PixelBounds& bounds = merged.pixelBounds;
        const uint64_t missing = frame.missingSamples();
        if (missing > 0 && missingSlices(merged).empty())
            reportMissing(fmt::format("{} samples of the pixels from {},{} to {},{} are missing", missing,
                                      bounds.x0, bounds.y0, bounds.x1 - 1, bounds.y1 - 1));
        if (bounds.width() != merged.fullWidth || bounds.height() != merged.fullHeight)
            m_log.warn("the parts show pixels {},{} to {},{} of a frame of {}x{}", bounds.x0, bounds.y0,
                       bounds.x1 - 1, bounds.y1 - 1, merged.fullWidth, merged.fullHeight);
        return missing;
    }

    void writeImages(MergedFrame& frame) const {
        if (std::all_of(m_options.images.begin(), m_options.images.end(), isPart))
            return;
        const uint64_t missing = checkSamples(frame);
        if (!frame.film().records().isEmpty())
            integrator()->finishMerged(frame.film());
        const RecordedAovs aovs = recordedAovs(frame.surfaces(), frame.lights());
        for (const auto& image : m_options.images) {
            if (isPart(image))
                continue;
            writeImage(image, frame.film(), aovs, missing);
            if (!isStandardStream(image))
                m_log.info("wrote {}", image.string());
        }
    }

    void writeImage(const std::filesystem::path& image, const Film& film, const RecordedAovs& aovs,
                    uint64_t missing) const {
        Metadata metadata = metadataOf(film, missing);
        if (imageFormatOf(image) != ImageFormat::Exr)
            addViewMetadata(m_options.format, metadata);
        else
            metadata.insert(metadata.end(), aovs.metadata.begin(), aovs.metadata.end());
        warnOfClampedValues(image, film.write(image, metadata, m_settings, aovs.parts, aovs.alpha), m_log);
    }

    Metadata metadataOf(const Film& film, uint64_t missing) const {
        Metadata m;
        for (const auto& [name, value] : m_parts.merged().key)
            if (name == PartHeader::kFrame)
                m.emplace_back("strobe:" + name, std::atoi(value.c_str()));
            else if (name != PartHeader::kFrameKey || missing == 0) // frames without a key are rendered again
                m.emplace_back("strobe:" + name, value);
        m.emplace_back("Software", std::string("strobe ") + version());
        m.emplace_back("strobe:samplesPerPixel", m_parts.merged().samplesPerPixel);
        m.emplace_back("strobe:invalidSamples", std::to_string(invalidSamples(film.sums())));
        if (missing > 0)
            m.emplace_back("strobe:unfinished", 1);
        return m;
    }

    Outcome reportInvalidSamples(const Film& film) const {
        const uint64_t invalid = invalidSamples(film.sums());
        if (invalid > 0)
            m_log.write(m_options.strict ? LogLevel::Error : LogLevel::Warning,
                        "{} samples were NaN, infinite or beyond 2.8e14 and are left out", invalid);
        return m_options.strict && invalid > 0 ? Outcome::InvalidSamples : Outcome::Finished;
    }

    const MergeOptions& m_options;
    const Log& m_log;
    const OutputSettings m_settings;
    const PartList m_parts;
};

} // namespace

Outcome mergeParts(const MergeOptions& options, const Log& log) {
    checkOptions(options);
    checkOutputFiles(options.images, options.makeFolders);
    checkOutputsAreNotInputs(options);
    return Merge(options, log).run();
}

} // namespace strobe
