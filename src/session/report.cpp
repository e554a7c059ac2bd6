#include "session/report.h"

#include "core/image/texture_cache.h"
#include "core/util/atomic_file.h"
#include "core/util/version.h"

#include <nlohmann/json.hpp>

namespace strobe {

namespace {

using Json = nlohmann::ordered_json;

void addCounts(const Counters& counters, Metadata& m) {
    m.emplace_back("strobe:rays", std::to_string(counters.rays()));
    m.emplace_back("strobe:visibilitySamples", std::to_string(counters.visibilitySamples));
    m.emplace_back("strobe:shades", std::to_string(counters.shades));
    m.emplace_back("strobe:invalidSamples", std::to_string(counters.invalidSamples));
}

void addSeconds(const RenderStats& stats, const StepSeconds& seconds, Metadata& m) {
    m.emplace_back("strobe:seconds:parse", float(seconds.parse));
    m.emplace_back("strobe:seconds:build", float(seconds.build));
    m.emplace_back("strobe:seconds:render", float(stats.seconds));
    m.emplace_back("strobe:seconds:begin", float(stats.beginSeconds));
    m.emplace_back("strobe:seconds:finish", float(stats.finishSeconds));
    for (int i = 0; i < kStageCount; ++i)
        m.emplace_back(std::string("strobe:threadSeconds:") + toString(Stage(i)),
                       float(stats.total.seconds[i]));
}

/// Returns a number or a truth value for the text of one, else the text.
Json typed(const std::string& text) {
    const Json value = Json::parse(text, nullptr, false);
    return value.is_number() || value.is_boolean() ? value : Json(text);
}

Json settingsOf(const BuiltScene& built, const FrameJob& job, const RenderStats& stats) {
    Json settings;
    for (const auto& [key, value] : built.metadata)
        if (const auto* text = std::get_if<std::string>(&value))
            settings[key.substr(key.find(':') + 1)] = typed(*text);
    settings["samplesPerPixel"] = stats.samplesPerPixel;
    settings["seed"] = job.options.seed;
    if (job.number)
        settings["frame"] = *job.number;
    settings["shutter"] = {built.scene->shutter().open, built.scene->shutter().close};
    return settings;
}

Json stagesOf(const Counters& c) {
    Json stages;
    for (int i = 0; i < kStageCount; ++i)
        stages[toString(Stage(i))] = c.seconds[i];
    return stages;
}

Json threadsOf(const RenderStats& stats) {
    Json threads;
    for (const Counters& thread : stats.threads)
        threads.push_back(
            {{"pixels", thread.pixels}, {"shades", thread.shades}, {"seconds", stagesOf(thread)}});
    return threads;
}

Json raysOf(const Counters& c) {
    return {{"camera", c.visibilitySamples},
            {"shadow", c.shadowRays},
            {"light", c.lightRays},
            {"bounce", c.bounceRays},
            {"total", c.rays()}};
}

Json cacheOf(const Counters& c) {
    return {{"lookups", c.cacheLookups},
            {"hits", c.cacheHits},
            {"hitRate", c.cacheLookups ? double(c.cacheHits) / double(c.cacheLookups) : 0},
            {"duplicates", c.cacheDuplicates},
            {"evictions", c.cacheEvictions},
            {"cacheBytes", c.cacheBytes}};
}

Json shadeCostsOf(const BuiltScene& built, const Counters& c) {
    Json costs = Json::array();
    for (size_t i = 0; i < c.shadeCosts.size(); ++i)
        if (const ShadeCost& cost = c.shadeCosts[i]; cost.shades() > 0)
            costs.push_back(
                {{"material", i < built.materialNames.size() ? built.materialNames[i] : "(nothing)"},
                 {"shadesTimed", cost.shades()},
                 {"meanSeconds", cost.mean()},
                 {"deviationSeconds", cost.deviation()}});
    return costs;
}

Json geometryOf(const BuiltScene& built) {
    const TracerCounts& t = built.scene->tracer().counts();
    return {{"triangles", t.triangles},
            {"quadrics", t.quadrics},
            {"instances", t.instances},
            {"timeSteps", t.timeSteps},
            {"filteredGeometries", t.filteredGeometries}};
}

Json texturesOf(const BuiltScene& built) {
    const TextureStatistics t = built.textures->statistics();
    return {{"smallImages", t.smallImages},           {"largeImages", t.largeImages},
            {"largeImagesRead", t.largeImagesRead},   {"tiledImages", t.tiledImages},
            {"threadSecondsToRead", t.secondsToRead}, {"limit", t.limit},
            {"bytesInMemory", t.bytesInMemory},       {"bytesInFiles", t.bytesInFiles},
            {"pageBytesRead", t.pageBytesRead},       {"pageBytesReadAgain", t.pageBytesReadAgain},
            {"tileBytesRead", t.tileBytesRead}};
}

void addCounters(const Counters& c, Json& j) {
    j["rays"] = raysOf(c);
    j["pixels"] = c.pixels;
    j["visibilitySamples"] = c.visibilitySamples;
    j["shades"] = c.shades;
    j["directShades"] = c.directShades;
    j["shadesPerPixel"] = c.pixels ? double(c.shades) / double(c.pixels) : 0;
    j["missed"] = c.missed;
    j["lightSamples"] = c.lightSamples;
    j["surfaces"] = c.surfaces;
    j["footprints"] = c.footprints;
    j["invalidSamples"] = c.invalidSamples;
    j["clampedSamples"] = c.clampedSamples;
    j["cache"] = cacheOf(c);
}

Json contentOf(const SceneContent& content) {
    Json files = Json::array();
    for (const auto& [name, hash] : content.files)
        files.push_back({name, fmt::format("{:016x}", hash)});
    return {{"hash", fmt::format("{:016x}", content.hash)}, {"files", files}};
}

/// Returns what does not depend on the samples.
Json toJson(const BuiltScene& built, const FrameJob& job, const RenderStats& stats) {
    Json j;
    j["version"] = version();
    for (const auto& scene : job.options.scenes)
        j["scenes"].push_back(scene.string());
    j["content"] = contentOf(job.content);
    j["settings"] = settingsOf(built, job, stats);
    j["resolution"] = {built.resolution.x, built.resolution.y};
    const PixelBounds& bounds = built.pixelBounds;
    j["pixelBounds"] = {bounds.x0, bounds.x1, bounds.y0, bounds.y1};
    j["geometry"] = geometryOf(built);
    return j;
}

Json toJson(const BuiltScene& built, const FrameJob& job, const RenderStats& stats,
            const StepSeconds& seconds) {
    Json j = toJson(built, job, stats);
    j["passes"] = stats.passes;
    if (stats.noise)
        j["noise"] = *stats.noise;
    if (!stats.integratorNote.empty())
        j["integratorNote"] = stats.integratorNote;
    const BiasBound bound = built.integrator->biasBound(*built.scene);
    j["bias"] = {{"reachPixels", bound.reachPixels}, {"shutterFraction", bound.shutterFraction}};
    j["seconds"] = {{"parse", seconds.parse},
                    {"build", seconds.build},
                    {"render", stats.seconds},
                    {"begin", stats.beginSeconds},
                    {"finish", stats.finishSeconds}};
    j["threadSeconds"] = stagesOf(stats.total);
    if (!stats.threads.empty())
        j["threads"] = threadsOf(stats);
    addCounters(stats.total, j);
    j["shadeCost"] = shadeCostsOf(built, stats.total);
    j["textures"] = texturesOf(built);
    return j;
}

/// Returns the options that, added to those of the render, render this sample alone.
std::string replayOptions(const InvalidSample& sample, const FrameJob& job, const BuiltScene& built) {
    std::string words = fmt::format("--pixel {},{} --sample {}", sample.x, sample.y, sample.sample);
    if (job.number)
        words += fmt::format(" --frames {0}:{0}", *job.number);
    if (sample.seed != job.options.seed)
        words += fmt::format(" --seed {}", sample.seed);
    if (sample.samplesPerPixel != built.sampler.samplesPerPixel)
        words += fmt::format(" --spp {}", sample.samplesPerPixel);
    return words;
}

} // namespace

Metadata renderMetadata(const BuiltScene& built, const FrameJob& job, const RenderStats& stats,
                        const StepSeconds& seconds, bool isFinished) {
    const RenderOptions& options = job.options;
    Metadata m = built.metadata;
    m.emplace_back("Software", std::string("strobe ") + version());
    m.emplace_back("strobe:version", version());
    m.emplace_back("strobe:samplesPerPixel", int(stats.samplesPerPixel));
    if (!isFinished)
        m.emplace_back("strobe:unfinished", 1);
    if (const auto& s = options.sampleRange)
        m.emplace_back("strobe:samples", fmt::format("{}:{}", s->first, s->end));
    if (stats.passes > 1)
        m.emplace_back("strobe:passes", stats.passes);
    if (stats.noise)
        m.emplace_back("strobe:noise", float(*stats.noise));
    m.emplace_back("strobe:seed", std::to_string(options.seed));
    if (job.number) {
        m.emplace_back("strobe:frame", *job.number);
        if (isFinished) // frames without a key are rendered again
            m.emplace_back("strobe:frameKey", job.key);
    }
    m.emplace_back("strobe:shutter:open", built.scene->shutter().open);
    m.emplace_back("strobe:shutter:close", built.scene->shutter().close);
    if (const auto camera = built.scene->camera().matrices()) {
        m.emplace_back("worldToCamera", camera->worldToCamera);
        m.emplace_back("worldToNDC", camera->worldToNdc);
    }
    if (!options.commandLine.empty())
        m.emplace_back("strobe:commandLine", options.commandLine);
    m.emplace_back("strobe:sceneHash", fmt::format("{:016x}", job.content.hash));
    const BiasBound bound = built.integrator->biasBound(*built.scene);
    m.emplace_back("strobe:bias:reachPixels", bound.reachPixels);
    m.emplace_back("strobe:bias:shutterFraction", bound.shutterFraction);
    if (options.clamp > 0)
        m.emplace_back("strobe:bias:clamp", options.clamp);
    if (!stats.integratorNote.empty())
        m.emplace_back("strobe:integratorNote", stats.integratorNote);
    addCounts(stats.total, m);
    addSeconds(stats, seconds, m);
    return m;
}

void writeStats(const std::filesystem::path& file, const BuiltScene& built, const FrameJob& job,
                const RenderStats& stats, const StepSeconds& seconds) {
    writeFileAtomically(file, toJson(built, job, stats, seconds).dump(2) + '\n');
}

void writeEstimate(const std::filesystem::path& file, const FrameJob& job, const FrameInputs& inputs,
                   const Estimate& estimate) {
    RenderStats stats;
    stats.samplesPerPixel = uint32_t(inputs.built.sampler.samplesPerPixel);
    Json j = toJson(inputs.built, job, stats);
    j["estimate"] = {{"load", inputs.seconds.parse + inputs.seconds.build},
                     {"threadSeconds", estimate.threadSeconds},
                     {"memory", estimate.memory}};
    if (!estimate.frames.empty())
        j["frames"] = {{"all", estimate.frames}, {"finished", estimate.finished}};
    writeFileAtomically(file, j.dump(2) + '\n');
}

std::string summary(const BuiltScene& built, const RenderStats& stats, const StepSeconds& seconds) {
    const Counters& c = stats.total;
    return fmt::format("{}x{} pixels, {} spp: {:.2f} s (+ {:.2f} s to load), {:.1f} M rays, {:.1f} M rays/s, "
                       "{:.2f} shades per pixel{}{}",
                       built.pixelBounds.width(), built.pixelBounds.height(), stats.samplesPerPixel,
                       stats.seconds, seconds.parse + seconds.build, double(c.rays()) * 1e-6,
                       double(c.rays()) * 1e-6 / stats.seconds,
                       double(c.shades) / double(std::max<uint64_t>(c.pixels, 1)),
                       stats.integratorNote.empty() ? "" : ", ", stats.integratorNote);
}

void reportTextures(const BuiltScene& built, const Log& log) {
    const TextureStatistics t = built.textures->statistics();
    if (t.thrashes())
        log.warn(
            "textures were read again and again: {} from files, although all of them have {}; the render is "
            "faster with --texture-mb {} or more",
            formatBytes(t.pageBytesRead + t.tileBytesRead), formatBytes(t.bytesInFiles + t.tileBytesKnown),
            ((t.bytesInMemory + t.bytesInFiles + t.tileBytesKnown) >> 20) + 1);
}

void reportInvalidSamples(const RenderStats& stats, const FrameJob& job, const BuiltScene& built,
                          const Log& log) {
    const Counters& total = stats.total;
    if (total.clampedSamples > 0)
        log.warn("--clamp {}: {} samples were scaled down; the image is biased", job.options.clamp,
                 total.clampedSamples);
    if (total.invalidSamples == 0)
        return;
    log.write(job.options.strict ? LogLevel::Error : LogLevel::Warning,
              "{} samples were NaN, infinite or beyond 2.8e14 and are left out{}", total.invalidSamples,
              total.firstInvalid.empty() ? "" : "; the first:");
    for (const InvalidSample& sample : total.firstInvalid)
        log.warn("  replay with {}", replayOptions(sample, job, built));
    for (const std::string& image : built.textures->imagesWithInvalidValues())
        log.warn("  the image {} has values that are NaN or infinite", image);
}

} // namespace strobe
