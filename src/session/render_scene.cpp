#include "core/util/memory.h"
#include "loader/parser/content_hash.h"
#include "loader/parser/parser.h"
#include "session/estimate.h"
#include "session/exposure.h"
#include "session/files/expected_scene.h"
#include "session/files/part_file.h"
#include "session/frame.h"
#include "session/outputs.h"
#include "session/render_session.h"
#include "session/report.h"
#include "session/session.h"

#include <set>

namespace strobe {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Throws Error of kind Usage if `table` has no plugin of this name. If `others` has, the error names the
/// option that chooses it.
template <class Row, class Other>
void checkPluginName(const std::string& name, const char* kind, const char* option,
                     const std::vector<Row>& table, const char* optionOfOthers,
                     const std::vector<Other>& others) {
    if (name.empty())
        return;
    if (std::any_of(others.begin(), others.end(), [&](const Other& row) { return row.name == name; }))
        throw Error(
            fmt::format("{0} {1}: there is no such {3}; use {2} {1}", option, name, optionOfOthers, kind),
            ErrorKind::Usage);
    findPlugin(table, name, kind, {});
}

/// Throws the errors that can be found without the scene.
void checkBeforeParsing(const RenderOptions& options) {
    if (options.scenes.empty())
        throw Error("there is no scene file", ErrorKind::Usage);
    const PluginTables tables = pluginTables(*options.build.plugins);
    checkPluginName(options.build.integrator, "integrator", "--integrator", tables.integrators, "--shading",
                    tables.shaders);
    checkPluginName(options.build.shading, "shading integrator", "--shading", tables.shaders, "--integrator",
                    tables.integrators);
    outputSettings(options.output.format, options.threads);
    checkOutputFiles(options);
}

std::set<std::string> integratorNames(const PluginLibraries& libraries) {
    std::set<std::string> names;
    for (const auto& row : pluginTables(libraries).integrators)
        names.insert(row.name);
    return names;
}

/// A call of renderScene or renderPixel.
class SceneRenderer {
  public:
    /// Checks the options and parses the scene.
    SceneRenderer(const RenderOptions& options, const Log& log, const RenderCallbacks& callbacks)
        : m_options(options), m_build(options.build), m_log(log), m_callbacks(callbacks),
          m_start(options.progressive.start.value_or(Clock::now())),
          m_diagnostics([&log](const std::string& text) { log.warn("{}", text); },
                        [&log](const std::string& text) { log.info("{}", text); }) {
        checkBeforeParsing(options);
        m_diagnostics.setStrict(options.strict);
        if (m_build.textureMegabytes == 0 && options.resources.maxMemory > 0)
            m_build.textureMegabytes = int(std::max<uint64_t>(options.resources.maxMemory / 2 >> 20, 1));
        m_policy = std::make_shared<const ResourcePolicy>(options.resources);
        const Clock::time_point start = Clock::now();
        m_description = parseFiles(options.scenes, integratorNames(*options.build.plugins), m_diagnostics,
                                   m_policy, options.build.defines);
        std::erase_if(m_build.defines, [this](const std::string& define) {
            return m_description.values.contains(define.substr(0, define.find('=')));
        });
        m_seconds.parse = secondsSince(start);
    }

    Outcome renderImage() {
        FrameJob job;
        if (!m_options.output.noImage || !m_options.output.stats.empty() || !m_options.expected.empty())
            job.content = content();
        const BuiltScene built = buildImage();
        job.options = withDefaultImage(m_options, built.filename, m_log);
        if (!m_options.dryRun && hasAutomaticExposure(job.options, built))
            job.options.output.format.exposure = measuredExposure(built);
        const FrameInputs inputs{built, *m_policy, m_seconds, m_start, m_callbacks, m_log};
        return m_options.dryRun ? dryRun(job, inputs) : renderFrame(job, inputs);
    }

    Outcome renderSequence();
    PixelResult renderPixel(const PixelQuery& query);

  private:
    /// Throws Error of kind Usage if it is not the expected one.
    SceneContent content() const {
        SceneContent content = contentOf(m_description, usedPlugins(*m_build.plugins, m_description,
                                                                    {m_build.integrator, m_build.shading}));
        if (!m_options.expected.empty())
            checkExpectedScene(m_options.expected, {content.hash, content.files});
        return content;
    }
    static Outcome dryRun(const FrameJob& job, const FrameInputs& inputs, std::vector<int> frames = {},
                          std::vector<int> finished = {}) {
        checkOutputFiles(job.options);
        checkOutputsAreNotInputs(job.options, inputs.policy);
        reportDryRun(job, inputs, std::move(frames), std::move(finished));
        return Outcome::Finished;
    }
    Outcome dryRunOfSequence(RenderOptions options, SceneBuilder& builder, const SceneContent& content);
    BuiltScene buildFrame(int number);
    float measuredExposure(const BuiltScene& built) const {
        const float exposure = automaticExposure(built);
        m_log.info("exposure    {:+g} stops, from the lights of the file (--exposure overrides)", exposure);
        return exposure;
    }
    BuiltScene buildImage() {
        const Clock::time_point start = Clock::now();
        BuiltScene built = buildScene(std::move(m_description), m_build, m_diagnostics);
        m_seconds.build = secondsSince(start);
        m_log.debug("parsed in {:.3f} s, built in {:.3f} s", m_seconds.parse, m_seconds.build);
        return built;
    }

    const RenderOptions& m_options;
    BuildOptions m_build; ///< without the defines that the scene uses as values
    const Log& m_log;
    const RenderCallbacks& m_callbacks;
    const Clock::time_point m_start;
    Diagnostics m_diagnostics;
    std::shared_ptr<const ResourcePolicy> m_policy;
    SceneDescription m_description;
    StepSeconds m_seconds;
};

/// Reports the first frame that is not finished, or else the first one. The statistics are of all frames.
Outcome SceneRenderer::dryRunOfSequence(RenderOptions options, SceneBuilder& builder,
                                        const SceneContent& content) {
    const std::filesystem::path stats = std::exchange(options.output.stats, {});
    const SequenceOptions& sequence = *options.sequence;
    std::vector<int> finished;
    std::optional<FrameJob> first;
    for (const int number : sequence.frames) {
        FrameJob job = frameJob(options, number, content);
        if (!sequence.overwrite && isFinished(job))
            finished.push_back(number);
        else if (!first)
            first = std::move(job);
    }
    FrameJob job = first ? *first : frameJob(options, sequence.frames.front(), content);
    job.options.output.stats = stats;
    const Clock::time_point start = Clock::now();
    const BuiltScene built = builder.build(shutterOf(sequence, *job.number));
    m_seconds.build = secondsSince(start);
    return dryRun(job, {built, *m_policy, m_seconds, start, m_callbacks, m_log}, sequence.frames,
                  std::move(finished));
}

Outcome SceneRenderer::renderSequence() {
    const SequenceOptions& sequence = *m_options.sequence;
    const SceneContent content = this->content();
    Clock::time_point start = Clock::now();
    SceneBuilder builder(std::move(m_description), m_build, m_diagnostics);
    RenderOptions options = withDefaultImage(m_options, builder.setup().filename, m_log);
    if (m_options.dryRun)
        return dryRunOfSequence(options, builder, content);
    const size_t count = sequence.frames.size();
    size_t finished = 0;
    Outcome outcome = Outcome::Finished;
    for (size_t i = 0; i < count; ++i) {
        const int number = sequence.frames[i];
        FrameJob job = frameJob(options, number, content);
        if (!sequence.overwrite && isFinished(job)) {
            m_log.debug("frame {} is finished", number);
            ++finished;
            continue;
        }
        releaseFreeMemory(); // of the previous frame
        m_log.info("frame {} ({} of {})", number, i + 1, count);
        // All frames have the exposure of the first one, also if it was rendered before.
        if (hasAutomaticExposure(options, builder.setup()))
            options.output.format.exposure =
                measuredExposure(builder.build(shutterOf(sequence, sequence.frames.front())));
        job.options.output.format.exposure = options.output.format.exposure;
        const BuiltScene built = builder.build(shutterOf(sequence, number));
        m_seconds.build = secondsSince(start);
        const FrameInputs inputs{built, *m_policy, m_seconds, start, m_callbacks, m_log};
        const Outcome ofFrame = renderFrame(job, inputs);
        if (ofFrame != Outcome::Finished)
            outcome = ofFrame;
        // Later frames could not be written either.
        if (ofFrame == Outcome::OutputFailed || ofFrame == Outcome::Interrupted)
            return ofFrame;
        start = Clock::now();
        m_seconds.parse = 0; // the scene was parsed once for all frames
    }
    m_log.info("{} frames: {} rendered now, {} before", count, count - finished, finished);
    return outcome;
}

BuiltScene SceneRenderer::buildFrame(int number) {
    SceneBuilder builder(std::move(m_description), m_build, m_diagnostics);
    return builder.build(shutterOf(*m_options.sequence, number));
}

void checkQuery(const PixelQuery& query, const V2i& resolution, int samplesPerPixel) {
    const V2i p = query.pixel;
    if (p.x < 0 || p.y < 0 || p.x >= resolution.x || p.y >= resolution.y)
        throw Error(
            fmt::format("--pixel {},{}: the frame has {}x{} pixels", p.x, p.y, resolution.x, resolution.y),
            ErrorKind::Usage);
    if (query.sample && *query.sample >= uint32_t(samplesPerPixel))
        throw Error(fmt::format("--sample {}: a pixel has {} samples", *query.sample, samplesPerPixel),
                    ErrorKind::Usage);
}

PixelResult SceneRenderer::renderPixel(const PixelQuery& query) {
    FrameJob job{m_options, {}, {}, {}};
    if (m_options.sequence)
        job.number = m_options.sequence->frames.front();
    const BuiltScene built = job.number ? buildFrame(*job.number) : buildImage();
    RenderSettings settings = renderSettings(m_options, built);
    checkQuery(query, built.resolution, settings.samplesPerPixel);
    Rgb sampleValue(0);
    settings.onSample = [&](const SampleRecord& record) {
        if (query.sample == record.number)
            sampleValue = record.value;
    };
    const V2i p = query.pixel;
    Film film(built.resolution.x, built.resolution.y, {p.x, p.y, p.x + 1, p.y + 1});
    const RenderStats stats = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                                     *built.filter, settings, film);
    reportInvalidSamples(stats, job, built, m_log);
    return {query.sample ? sampleValue : film.image().pixels[0], stats.total.invalidSamples};
}

} // namespace

Outcome renderScene(const RenderOptions& options, const Log& log, const RenderCallbacks& callbacks) {
    checkOptions(options);
    SceneRenderer renderer(options, log, callbacks);
    return options.sequence ? renderer.renderSequence() : renderer.renderImage();
}

PixelResult renderPixel(const RenderOptions& options, const PixelQuery& query, const Log& log) {
    checkPixelOptions(options);
    const RenderCallbacks callbacks;
    return SceneRenderer(options, log, callbacks).renderPixel(query);
}

} // namespace strobe
