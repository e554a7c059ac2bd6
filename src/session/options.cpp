#include "session/options.h"

#include "core/film/aov.h"
#include "core/image/image_format.h"
#include "core/util/standard_files.h"
#include "session/files/part.h"

#include <fmt/format.h>

#include <cmath>

namespace strobe {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& option, const std::string& problem) {
    throw Error(option + ": " + problem, ErrorKind::Usage);
}

/// An option as the command line calls it.
struct NamedOption {
    std::string name;
    bool isSet;
};

/// Throws if one of `some` and one of `others` are set.
void checkExclusion(std::initializer_list<NamedOption> some, std::initializer_list<NamedOption> others) {
    for (const NamedOption& one : some)
        for (const NamedOption& other : others)
            if (one.isSet && other.isSet)
                fail(other.name, "does not go with " + one.name);
}

void checkRequirement(const NamedOption& option, const NamedOption& required) {
    if (option.isSet && !required.isSet)
        fail(option.name, "needs " + required.name);
}

bool contains(const std::vector<Aov>& aovs, Aov aov) {
    return std::find(aovs.begin(), aovs.end(), aov) != aovs.end();
}

/// The name of the first AOV for which `isMeant` is true; empty if there is none.
std::string firstAov(const OutputOptions& output, bool (*isMeant)(const AovInfo&)) {
    for (const AovInfo& info : aovTable())
        if (isMeant(info) && contains(output.aovs, info.aov))
            return info.name;
    return {};
}

bool isNotVariance(const AovInfo& info) { return info.aov != Aov::Variance; }
/// Whether the values of disjoint samples cannot be added.
bool isOfSharing(const AovInfo& info) { return info.group == AovGroup::Sharing && isNotVariance(info); }

NamedOption namedAov(const std::string& name) { return {"--aov " + name, !name.empty()}; }

/// The options that may exclude or require each other.
struct NamedOptions {
    explicit NamedOptions(const RenderOptions& o)
        : outputs{"-o", !o.output.images.empty()}, parts{"-o *.part",
                                                         std::any_of(o.output.images.begin(),
                                                                     o.output.images.end(), isPart)},
          layers(namedAov(firstAov(o.output, isNotVariance))),
          sharing(namedAov(firstAov(o.output, isOfSharing))), variance{"--aov variance",
                                                                       contains(o.output.aovs,
                                                                                Aov::Variance)},
          heatmap{"--heatmap", !o.output.heatmap.empty()}, samples{"--samples", !o.output.samples.empty()},
          stats{"--stats", !o.output.stats.empty()}, timeLimit{"--time-limit", o.progressive.timeLimit > 0},
          noiseTarget{"--noise-target", o.progressive.noiseTarget > 0},
          reference{"--reference", !o.progressive.reference.empty()},
          curve{"--curve", !o.progressive.errorCurve.empty()}, writeInterval{"--write-interval",
                                                                             o.progressive.writeInterval > 0},
          checkpoint{"--checkpoint", o.progressive.checkpointInterval > 0},
          resume{"--resume", o.progressive.resume}, viewer{"--display-server",
                                                           o.progressive.viewer.has_value()},
          sampleRange{"--sample-range", o.sampleRange.has_value()}, slice{"--slice", o.slice.has_value()},
          onlyParts{"-o *.part, and no other image",
                    !o.output.images.empty() &&
                        std::all_of(o.output.images.begin(), o.output.images.end(), isPart)},
          severalFrames{"--frames with several frames", o.sequence && o.sequence->frames.size() > 1},
          crop{"--crop", o.build.crop.has_value()}, pixelBounds{"--pixel-bounds",
                                                                o.build.pixelBounds.has_value()},
          noImage{"--no-output", o.output.noImage}, dryRun{"--dry-run", o.dryRun} {}

    NamedOption outputs, parts, layers, sharing, variance, heatmap, samples, stats;
    NamedOption timeLimit, noiseTarget, reference, curve, writeInterval, checkpoint, resume, viewer;
    NamedOption sampleRange, slice, onlyParts, severalFrames, crop, pixelBounds, noImage, dryRun;
};

void checkCombinations(const RenderOptions& options) {
    const NamedOptions o(options);
    checkExclusion({o.crop}, {o.pixelBounds});
    checkExclusion({o.noImage}, {o.outputs, o.writeInterval, o.checkpoint});
    checkExclusion({o.dryRun}, {o.checkpoint, o.reference});
    checkExclusion({o.timeLimit, o.noiseTarget, o.reference},
                   {o.samples, o.sharing, o.heatmap, o.sampleRange, o.checkpoint});
    checkExclusion({o.reference}, {o.layers});
    checkExclusion({o.timeLimit, o.noiseTarget}, {o.parts});
    checkExclusion({o.sampleRange, o.parts, o.checkpoint},
                   {o.sharing, o.variance, o.heatmap, o.severalFrames});
    checkExclusion({o.checkpoint}, {o.samples});
    checkExclusion({o.slice}, {o.sampleRange, o.reference});
    checkRequirement(o.slice, o.onlyParts);
    checkRequirement(o.variance, o.noiseTarget); // the variance is estimated from passes
    checkRequirement(o.curve, o.reference);
    checkRequirement(o.resume, o.checkpoint);
}

void checkRange(const char* option, bool isValid, const char* range) {
    if (!isValid)
        fail(option, std::string("must be ") + range);
}

/// More threads than on any machine. Embree and TBB fail with 100000.
constexpr int kMaxThreads = 4096;

/// The command line has narrower checks with texts of their own.
void checkRanges(const RenderOptions& o) {
    const ProgressiveOptions& p = o.progressive;
    for (const auto& [option, seconds] : {std::pair("--time-limit", p.timeLimit),
                                          {"--noise-target", p.noiseTarget},
                                          {"--write-interval", p.writeInterval},
                                          {"--checkpoint", p.checkpointInterval},
                                          {"--clamp", double(o.clamp)}})
        checkRange(option, std::isfinite(seconds) && seconds >= 0, "finite and not negative");
    checkRange("--exposure", std::isfinite(o.output.format.exposure.value_or(0)), "finite");
    checkRange("--threads", o.threads >= 0 && o.threads <= kMaxThreads, "in 0 to 4096");
    checkRange("--tile", o.tileSize >= 1, "at least 1");
    checkRange("--crypto-depth", o.output.cryptomatteEntries >= 1 && o.output.cryptomatteEntries <= 200,
               "in 1 to 200");
    checkRange("--slice", !o.slice || (o.slice->number < o.slice->count && o.slice->count <= kMaxSlices),
               "i/n with 1 <= i <= n <= 65536");
    if (const auto& s = o.sequence) {
        checkRange("--frames", !s->frames.empty(), "at least one frame");
        checkRange("--fps", s->fps >= 1e-6 && s->fps <= 1e6, "in 1e-6 to 1e6");
        checkRange("--shutter",
                   std::isfinite(s->shutterOpen) && std::isfinite(s->shutterClose) &&
                       s->shutterOpen <= s->shutterClose,
                   "finite and in ascending order");
    }
}

void checkImageNames(const std::vector<fs::path>& images) {
    for (const fs::path& image : images)
        if (!isPart(image) && !imageFormatOf(image))
            fail("-o", fmt::format("\"{}\" must end in {} or .part", image.string(), imageExtensions()));
}

void checkHeatmap(const OutputOptions& output) {
    if (!output.heatmap.empty() && imageFormatOf(output.heatmap) != ImageFormat::Png)
        fail("--heatmap", "\"" + output.heatmap.string() + "\" must end in .png");
    const AovInfo& info = aovInfo(output.heatmapAov);
    if (info.group != AovGroup::Sharing || info.aov == Aov::Variance)
        fail("--heatmap-of", std::string(info.name) + " has no heat map");
}

} // namespace

void checkOptions(const RenderOptions& options) {
    checkRanges(options);
    checkImageNames(options.output.images);
    checkHeatmap(options.output);
    if (options.sequence && options.build.shutter)
        fail("--frame-time", "renders a single frame; it does not go with --frames");
    if (options.sequence &&
        std::any_of(options.output.images.begin(), options.output.images.end(), isStandardStream))
        fail("-o -", "does not go with --frames");
    checkCombinations(options);
}

void checkPixelOptions(const RenderOptions& options) {
    checkOptions(options);
    const NamedOptions o(options);
    const NamedOption pixel{"--pixel", true};
    if (options.sequence && options.sequence->frames.size() > 1)
        fail(pixel.name, "renders a single frame; --frames has several");
    checkExclusion({o.timeLimit, o.noiseTarget, o.reference, o.sampleRange, o.parts, o.checkpoint}, {pixel});
    checkExclusion({pixel}, {o.outputs, o.stats, o.writeInterval, o.viewer, o.layers, o.heatmap, o.samples});
}

void checkOptions(const MergeOptions& options) {
    if (options.parts.empty())
        throw Error("there are no parts to merge", ErrorKind::Usage);
    if (options.images.empty())
        fail("-o", "is missing");
    checkImageNames(options.images);
    checkRange("--exposure", std::isfinite(options.format.exposure.value_or(0)), "finite");
}

} // namespace strobe
