#include "core/film/heatmap.h"
#include "core/util/standard_files.h"
#include "session/aov_recorder.h"
#include "session/estimate.h"
#include "session/exposure.h"
#include "session/files/merged_frame.h"
#include "session/outputs.h"
#include "session/render_session.h"
#include "session/report.h"

namespace strobe {

namespace {

/// Returns the AOVs that the film holds.
std::vector<Aov> filmAovs(const OutputOptions& output) {
    std::vector<Aov> aovs = aovsInGroup(output.aovs, AovGroup::Sharing);
    if (!output.heatmap.empty() && std::find(aovs.begin(), aovs.end(), output.heatmapAov) == aovs.end())
        aovs.push_back(output.heatmapAov);
    return aovs;
}

/// Warns of layers without an output that holds them.
void warnOfLayers(const OutputOptions& output, const Log& log) {
    const bool hasLayers =
        std::any_of(output.aovs.begin(), output.aovs.end(), [](Aov aov) { return aov != Aov::Alpha; });
    const bool isHeld = std::any_of(output.images.begin(), output.images.end(), [](const auto& image) {
        return imageFormatOf(image) == ImageFormat::Exr || isPart(image);
    });
    if (hasLayers && !isHeld)
        log.warn("--aov: there is no .exr output to hold the layers");
}

/// Renders one frame and writes its outputs.
class FrameRenderer {
  public:
    /// Throws Error if an output cannot be written.
    FrameRenderer(const FrameJob& job, const FrameInputs& inputs)
        : m_job(job), m_inputs(inputs), m_output(job.options.output), m_built(inputs.built),
          m_log(inputs.log), m_settings(renderSettings(job.options, m_built)),
          m_film(m_built.resolution.x, m_built.resolution.y, m_built.pixelBounds, filmAovs(m_output)),
          m_aovs(m_output.aovs, m_output.cryptomatteEntries, m_built, m_log), m_unfinished(m_log),
          m_outputSettings(outputSettings(m_output.format, job.options.threads)) {
        checkWork(job, m_built, m_settings, m_log);
        warnOfLayers(m_output, m_log);
        if (!m_output.samples.empty())
            m_settings.onSample = [this](const SampleRecord& record) { m_samples.add(record); };
        m_aovs.attachTo(m_settings);
        m_settings.recordsLayers &= m_settings.aovs || m_settings.lights;
        if (std::any_of(m_output.images.begin(), m_output.images.end(), isPart))
            m_film.enableAccumulation();
        for (const auto& image : m_output.images)
            if (!isPart(image))
                m_film.checkWrite(image, m_outputSettings, m_aovs.recorded().parts);
    }

    Outcome run() {
        RenderStats stats = render();
        if (!m_film.sums().empty()) // they include samples of the checkpoint
            stats.total.invalidSamples = invalidSamples(m_film.sums());
        const bool isFinished = stats.passes > 0 && !arePassesStopped();
        reportInvalidSamples(stats, m_job, m_built, m_log);
        reportTextures(m_built, m_log);
        reportVisibility(m_film, stats, m_job, m_built, m_log);
        if (!writeOutputs(stats, isFinished))
            return Outcome::OutputFailed;
        if (!isFinished) {
            reportInterruption(stats);
            return Outcome::Interrupted;
        }
        if (m_job.options.progressive.checkpointInterval > 0)
            Checkpoint::remove(m_job);
        m_unfinished.removeSeparate();
        m_log.info("{}", summary(m_built, stats, m_inputs.seconds));
        reportFiles();
        return m_job.options.strict && stats.total.invalidSamples > 0 ? Outcome::InvalidSamples
                                                                      : Outcome::Finished;
    }

  private:
    RenderStats render() {
        const WriteOutputs write = [this](const Film& film, const RenderStats& stats, bool isFinished) {
            const auto lock = lockWriting();
            for (const auto& image : m_output.images)
                writeImage(image, film, stats, isFinished);
        };
        const RenderStats stats = RenderSession(m_job, m_inputs, m_settings, m_film, write).run();
        if (stats.noise)
            m_log.info("noise {:.4g} after {} passes{}", *stats.noise, stats.passes,
                       *stats.noise <= m_job.options.progressive.noiseTarget ? ""
                                                                             : ": the target is not met");
        return stats;
    }

    /// Returns a lock that keeps signals from ending the program.
    std::unique_lock<std::mutex> lockWriting() const {
        RenderControl* control = m_inputs.callbacks.control;
        return control ? control->lockWriting() : std::unique_lock<std::mutex>();
    }

    /// Unfinished parts are not written. Unfinished images do not replace images with more samples.
    void writeImage(const std::filesystem::path& image, const Film& film, const RenderStats& stats,
                    bool isFinished) {
        if (isPart(image)) {
            if (isFinished)
                writePart(image, partHeaderOf(film, m_job, m_built, layoutOf(m_settings)), film);
        } else if (isFinished) {
            writeImageFile(image, film, stats, true);
        } else if (const auto file = m_unfinished.fileFor(image, film)) {
            writeImageFile(*file, film, stats, false);
        }
    }

    void writeImageFile(const std::filesystem::path& image, const Film& film, const RenderStats& stats,
                        bool isFinished) {
        const RecordedAovs aovs = isFinished ? m_aovs.recorded() : RecordedAovs{};
        Metadata metadata = renderMetadata(m_built, m_job, stats, m_inputs.seconds, isFinished);
        if (!isFinished)
            UnfinishedImages::addMetadata(film, metadata);
        if (imageFormatOf(image) != ImageFormat::Exr)
            addViewMetadata(m_output.format, metadata);
        else
            metadata.insert(metadata.end(), aovs.metadata.begin(), aovs.metadata.end());
        warnOfClampedValues(image, film.write(image, metadata, m_outputSettings, aovs.parts, aovs.alpha),
                            m_log);
    }

    /// Returns whether all files were written under their own names.
    bool writeOutputs(const RenderStats& stats, bool isFinished) {
        const auto lock = lockWriting();
        FallbackWriter writer(m_log);
        for (const auto& image : m_output.images)
            writer.write(image, [&](const auto& file) { writeImage(file, m_film, stats, isFinished); });
        if (!m_output.heatmap.empty())
            writer.write(m_output.heatmap, [&](const auto& file) {
                strobe::writeImage(file, heatmap(m_film, m_output.heatmapAov, m_settings.samplesPerPixel),
                                   renderMetadata(m_built, m_job, stats, m_inputs.seconds, isFinished));
            });
        if (!m_output.samples.empty())
            writer.write(m_output.samples, [&](const auto& file) { m_samples.write(file); });
        if (!m_output.stats.empty())
            writer.write(m_output.stats, [&](const auto& file) {
                writeStats(file, m_built, m_job, stats, m_inputs.seconds);
            });
        return writer.wroteAll();
    }

    void reportFiles() const {
        std::vector<std::filesystem::path> files = m_output.images;
        files.insert(files.end(), {m_output.heatmap, m_output.samples, m_output.stats});
        for (const auto& file : files)
            if (!file.empty() && !isStandardStream(file))
                m_log.info("wrote {}", file.string());
    }

    /// Whether passes were rendered, and ended by RenderControl::stop.
    bool arePassesStopped() const {
        const RenderControl* control = m_inputs.callbacks.control;
        return m_job.options.progressive.takesPasses() && control && control->isStopped();
    }

    void reportInterruption(const RenderStats& stats) {
        const ProgressiveOptions& progressive = m_job.options.progressive;
        if (progressive.takesPasses())
            m_log.warn("stopped after {} passes", stats.passes);
        else if (Checkpoint::exists(m_job))
            m_log.warn("stopped; --resume continues");
        else
            m_log.warn("stopped");
    }

    const FrameJob& m_job;
    const FrameInputs& m_inputs;
    const OutputOptions& m_output;
    const BuiltScene& m_built;
    const Log& m_log;
    RenderSettings m_settings;
    SampleTable m_samples;
    Film m_film;
    AovRecorder m_aovs;
    UnfinishedImages m_unfinished;
    const OutputSettings m_outputSettings;
};

} // namespace

Outcome renderFrame(const FrameJob& job, const FrameInputs& inputs) {
    checkOutputFiles(job.options);
    checkOutputsAreNotInputs(job.options, inputs.policy);
    return FrameRenderer(job, inputs).run();
}

} // namespace strobe
