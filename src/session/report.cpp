#include "session/report.h"

#include "core/util/atomic_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace strobe {

Metadata renderMetadata(const BuiltScene& built, const Options& options, const RenderStats& stats,
                        const StepSeconds& seconds, bool finished) {
    Metadata m = built.metadata;
    m.emplace_back("Software", "strobe " STROBE_VERSION);
    m.emplace_back("strobe:version", STROBE_VERSION);
    m.emplace_back("strobe:samplesPerPixel", int(stats.samplesPerPixel));
    if (!finished)
        m.emplace_back("strobe:unfinished", 1);
    if (const auto& s = options.samples)
        m.emplace_back("strobe:samples", fmt::format("{}:{}", s->first, s->end));
    if (stats.passes > 1)
        m.emplace_back("strobe:passes", stats.passes);
    if (stats.noise)
        m.emplace_back("strobe:noise", float(*stats.noise));
    m.emplace_back("strobe:seed", std::to_string(options.seed));
    if (options.frame) {
        m.emplace_back("strobe:frame", *options.frame);
        if (finished) // an unfinished frame is not to be skipped
            m.emplace_back("strobe:frameKey", options.frameKey);
    }
    m.emplace_back("strobe:shutter:open", built.scene->shutter().open);
    m.emplace_back("strobe:shutter:close", built.scene->shutter().close);
    const BiasBound bound = built.integrator->biasBound(*built.scene);
    m.emplace_back("strobe:bias:reachPixels", bound.reachPixels);
    m.emplace_back("strobe:bias:shutterFraction", bound.shutterFraction);
    if (options.clamp > 0)
        m.emplace_back("strobe:bias:clamp", options.clamp);
    m.emplace_back("strobe:rays", std::to_string(stats.total.rays()));
    m.emplace_back("strobe:visibilitySamples", std::to_string(stats.total.visibilitySamples));
    m.emplace_back("strobe:shades", std::to_string(stats.total.shades));
    m.emplace_back("strobe:invalidSamples", std::to_string(stats.total.invalidSamples));
    m.emplace_back("strobe:seconds:parse", float(seconds.parse));
    m.emplace_back("strobe:seconds:build", float(seconds.build));
    m.emplace_back("strobe:seconds:render", float(stats.seconds));
    for (int i = 0; i < kStageCount; ++i)
        m.emplace_back(std::string("strobe:threadSeconds:") + toString(Stage(i)),
                       float(stats.total.seconds[i]));
    return m;
}

namespace {

nlohmann::ordered_json stagesOf(const Counters& c) {
    nlohmann::ordered_json stages;
    for (int i = 0; i < kStageCount; ++i)
        stages[toString(Stage(i))] = c.seconds[i];
    return stages;
}

nlohmann::ordered_json costsOf(const BuiltScene& built, const Counters& c) {
    auto costs = nlohmann::ordered_json::array();
    for (size_t i = 0; i < c.shadeCosts.size(); ++i)
        if (const ShadeCost& cost = c.shadeCosts[i]; cost.shades() > 0)
            costs.push_back(
                {{"material", i < built.materialNames.size() ? built.materialNames[i] : "(nothing)"},
                 {"shadesTimed", cost.shades()},
                 {"meanSeconds", cost.mean()},
                 {"deviationSeconds", cost.deviation()}});
    return costs;
}

nlohmann::ordered_json toJson(const BuiltScene& built, const Options& options, const RenderStats& stats,
                              const StepSeconds& seconds) {
    const Counters& c = stats.total;
    const TracerCounts& t = built.scene->tracer().counts();
    nlohmann::ordered_json j;
    j["version"] = STROBE_VERSION;
    for (const auto& scene : options.scenes)
        j["scenes"].push_back(scene.string());
    for (const auto& [key, value] : built.metadata)
        if (const auto* text = std::get_if<std::string>(&value))
            j["settings"][key.substr(key.find(':') + 1)] = *text;
    j["settings"]["samplesPerPixel"] = stats.samplesPerPixel;
    j["settings"]["seed"] = options.seed;
    if (options.frame)
        j["settings"]["frame"] = *options.frame;
    j["settings"]["shutter"] = {built.scene->shutter().open, built.scene->shutter().close};
    const BiasBound bound = built.integrator->biasBound(*built.scene);
    j["passes"] = stats.passes;
    if (stats.noise)
        j["noise"] = *stats.noise;
    j["bias"] = {{"reachPixels", bound.reachPixels}, {"shutterFraction", bound.shutterFraction}};
    j["resolution"] = {built.resolution.x, built.resolution.y};
    j["pixelBounds"] = {built.pixelBounds.x0, built.pixelBounds.x1, built.pixelBounds.y0,
                        built.pixelBounds.y1};
    j["seconds"] = {{"parse", seconds.parse}, {"build", seconds.build}, {"render", stats.seconds}};
    j["threadSeconds"] = stagesOf(c);
    for (const Counters& thread : stats.threads)
        j["threads"].push_back(
            {{"pixels", thread.pixels}, {"shades", thread.shades}, {"seconds", stagesOf(thread)}});
    j["rays"] = {{"camera", c.visibilitySamples},
                 {"shadow", c.shadowRays},
                 {"light", c.lightRays},
                 {"bounce", c.bounceRays},
                 {"total", c.rays()}};
    j["pixels"] = c.pixels;
    j["visibilitySamples"] = c.visibilitySamples;
    j["shades"] = c.shades;
    j["directShades"] = c.directShades;
    j["shadesPerPixel"] = c.pixels ? double(c.shades) / double(c.pixels) : 0;
    j["missed"] = c.missed;
    j["surfaces"] = c.surfaces;
    j["footprints"] = c.footprints;
    j["invalidSamples"] = c.invalidSamples;
    j["clampedSamples"] = c.clampedSamples;
    j["cache"] = {{"lookups", c.cacheLookups},
                  {"hits", c.cacheHits},
                  {"hitRate", c.cacheLookups ? double(c.cacheHits) / double(c.cacheLookups) : 0},
                  {"duplicates", c.cacheDuplicates},
                  {"evictions", c.cacheEvictions},
                  {"cacheBytes", c.cacheBytes}};
    j["shadeCost"] = costsOf(built, c);
    j["geometry"] = {{"triangles", t.triangles},
                     {"quadrics", t.quadrics},
                     {"instances", t.instances},
                     {"timeSteps", t.timeSteps},
                     {"filteredGeometries", t.filteredGeometries}};
    return j;
}

} // namespace

void writeStats(const std::filesystem::path& file, const BuiltScene& built, const Options& options,
                const RenderStats& stats, const StepSeconds& seconds) {
    writeFileAtomically(file, toJson(built, options, stats, seconds).dump(2) + '\n');
}

std::string summary(const BuiltScene& built, const RenderStats& stats, const StepSeconds& seconds) {
    const Counters& c = stats.total;
    return fmt::format("{}x{} pixels, {} spp: {:.2f} s (+ {:.2f} s to load), {:.1f} M rays, {:.1f} M rays/s, "
                       "{:.2f} shades per pixel",
                       built.pixelBounds.width(), built.pixelBounds.height(), stats.samplesPerPixel,
                       stats.seconds, seconds.parse + seconds.build, double(c.rays()) * 1e-6,
                       double(c.rays()) * 1e-6 / stats.seconds,
                       double(c.shades) / double(std::max<uint64_t>(c.pixels, 1)));
}

} // namespace strobe
