#include "session/estimate.h"

#include "core/util/memory.h"
#include "session/files/part.h"
#include "session/render_session.h"
#include "session/report.h"

#include <thread>

namespace strobe {

namespace {

/// "12 s", "5 min", "3.2 hours" or "12 days".
std::string formatTime(double seconds) {
    if (seconds < 100)
        return fmt::format("{:.2g} s", seconds);
    if (seconds < 100 * 60)
        return fmt::format("{:.0f} min", seconds / 60);
    return seconds < 48 * 3600 ? fmt::format("{:.0f} hours", seconds / 3600)
                               : fmt::format("{:.0f} days", seconds / 86400);
}

double pixelCount(const PixelBounds& bounds) { return double(bounds.width()) * bounds.height(); }

uint32_t samplesOf(const RenderSettings& settings) {
    return settings.slice ? settings.slice->count() : uint32_t(settings.samplesPerPixel);
}

/// Returns about how many pixels are rendered.
double pixelCount(const FrameJob& job, const BuiltScene& built) {
    return pixelCount(built.pixelBounds) / (job.options.slice ? job.options.slice->count : 1);
}

int threadsOf(const RenderOptions& options) {
    return options.threads > 0 ? options.threads : int(std::thread::hardware_concurrency());
}

/// Returns a square of pixels in the middle of the bounds.
PixelBounds middleOf(const PixelBounds& bounds) {
    constexpr int kEdge = 256;
    const int width = std::min(bounds.width(), kEdge), height = std::min(bounds.height(), kEdge);
    const int x = bounds.x0 + (bounds.width() - width) / 2, y = bounds.y0 + (bounds.height() - height) / 2;
    return {x, y, x + width, y + height};
}

/// Returns the seconds of a render of paths with about five vertices.
double usualSeconds(double shades, const RenderOptions& options) {
    constexpr double kShadesPerSecond = 1e6; // and core
    return shades / kShadesPerSecond / threadsOf(options);
}

/// Returns the bytes of a film.
uint64_t filmBytes(const FrameJob& job, const BuiltScene& built) {
    const auto& images = job.options.output.images;
    const bool keepsSums = job.options.progressive.checkpointInterval > 0 ||
                           job.options.progressive.takesPasses() ||
                           std::any_of(images.begin(), images.end(), isPart);
    const size_t bytes = sizeof(Rgb) + (keepsSums ? sizeof(PixelAccumulator) : 0);
    return uint64_t(pixelCount(built.pixelBounds)) * bytes;
}

/// Sets the seconds and adds to the memory, by a render with few samples. Passes end at their time limit.
void estimateByRender(const FrameJob& job, const BuiltScene& built, Estimate& estimate) {
    constexpr int kSamples = 4;
    constexpr double kMaxSeconds = 10; // for the estimate
    RenderSettings settings = renderSettings(job.options, built);
    const double pixelSamples = pixelCount(job, built) * samplesOf(settings);
    const double threads = threadsOf(job.options);
    settings.samplesPerPixel =
        built.sampler.sampler->roundCount(std::min(settings.samplesPerPixel, kSamples));
    settings.slice.reset();
    settings.regions.clear();
    const PixelBounds middle = middleOf(built.pixelBounds);
    const auto shadesOf = [&](double pixels, int samples) {
        return pixels * built.integrator->shadesPerPixel(samples);
    };
    if (usualSeconds(shadesOf(pixelCount(middle), settings.samplesPerPixel), job.options) > kMaxSeconds) {
        estimate.threadSeconds =
            threads * usualSeconds(shadesOf(pixelCount(job, built), int(samplesOf(settings))), job.options);
        return;
    }
    Film film(built.resolution.x, built.resolution.y, middle);
    const RenderStats stats = render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                                     *built.filter, settings, film);
    const double seconds = stats.seconds * pixelSamples / (pixelCount(middle) * settings.samplesPerPixel);
    const double limit = job.options.progressive.timeLimit;
    estimate.threadSeconds = threads * (limit > 0 ? std::min(limit, seconds) : seconds);
    estimate.memory += uint64_t(double(stats.total.cacheBytes) * pixelCount(job, built) / pixelCount(middle));
}

} // namespace

void checkWork(const FrameJob& job, const BuiltScene& built, const RenderSettings& settings, const Log& log) {
    constexpr double kBytesPerRow = 120; // of the table in memory, and about those of its text
    const double pixels = pixelCount(job, built);
    const uint32_t samples = samplesOf(settings);
    const double shades = pixels * built.integrator->shadesPerPixel(int(samples));
    const double seconds = usualSeconds(std::max(shades, pixels * samples / 10), job.options);
    if (seconds > 3 * 3600 && !job.options.progressive.takesPasses())
        log.warn(
            "{:.2g} visibility samples and about {:.2g} shades: at a million shades per second and core, "
            "{}",
            pixels * samples, shades, formatTime(seconds));
    if (job.options.output.samples.empty())
        return;
    const double bytes = pixels * samples * kBytesPerRow;
    if (bytes > double(physicalMemory()))
        throw Error(
            fmt::format("--samples: {:.2g} samples take {} of memory, more than this machine has: use "
                        "a --crop or fewer samples",
                        pixels * samples, formatBytes(uint64_t(bytes))),
            ErrorKind::Usage);
    if (bytes > 1e9)
        log.warn("--samples: {:.2g} samples take {} of memory, and about as much in the file",
                 pixels * samples, formatBytes(uint64_t(bytes)));
}

void reportDryRun(const FrameJob& job, const FrameInputs& inputs, std::vector<int> frames,
                  std::vector<int> finished) {
    const BuiltScene& built = inputs.built;
    const PixelBounds& bounds = built.pixelBounds;
    const TracerCounts& counts = built.scene->tracer().counts();
    const auto metadata = [&](const char* name) {
        for (const auto& [key, value] : built.metadata)
            if (key == name)
                return std::get<std::string>(value);
        return std::string();
    };
    const Log& log = inputs.log;
    checkWork(job, built, renderSettings(job.options, built), log);
    log.info("frame       {}x{} pixels{}, {} samples per pixel{}", built.resolution.x, built.resolution.y,
             pixelCount(bounds) < double(built.resolution.x) * built.resolution.y
                 ? fmt::format(", of which {}x{}", bounds.width(), bounds.height())
                 : "",
             built.sampler.samplesPerPixel,
             frames.size() > 1 ? fmt::format("; {} frames, {} finished", frames.size(), finished.size())
                               : "");
    log.info("integrator  {}, {}; sampler {}, filter {}", metadata("strobe:integrator"),
             metadata("strobe:shading"), metadata("strobe:sampler"), metadata("strobe:filter"));
    log.info("geometry    {} triangles, {} quadrics, {} instances; {} lights", counts.triangles,
             counts.quadrics, counts.instances, built.scene->lights().size());
    for (const auto& image : job.options.output.images)
        log.info("output      {}", image.string());
    Estimate estimate;
    const uint64_t loaded = usedMemory();
    estimate.memory = loaded + filmBytes(job, built);
    estimateByRender(job, built, estimate);
    const size_t missing = frames.empty() ? 1 : frames.size() - finished.size();
    log.info("memory      {} after loading, about {} to render", formatBytes(loaded),
             formatBytes(estimate.memory));
    log.info("time        about {} on {} threads, and {:.2g} s to load",
             formatTime(estimate.threadSeconds * double(missing) / threadsOf(job.options)),
             threadsOf(job.options), inputs.seconds.parse + inputs.seconds.build);
    estimate.frames = std::move(frames);
    estimate.finished = std::move(finished);
    if (!job.options.output.stats.empty())
        writeEstimate(job.options.output.stats, job, inputs, estimate);
}

} // namespace strobe
