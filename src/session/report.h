// What a finished render says about itself: EXR metadata, JSON statistics, one line for people.
#pragma once

#include "core/render/render.h"
#include "session/options.h"

namespace strobe {

/// Wall-clock seconds of the steps of main before rendering.
struct StepSeconds {
    double parse = 0, build = 0;
};

Metadata renderMetadata(const BuiltScene& built, const Options& options, const RenderStats& stats,
                        const StepSeconds& seconds, bool finished);
/// Throws Error of kind Output.
void writeStats(const std::filesystem::path& file, const BuiltScene& built, const Options& options,
                const RenderStats& stats, const StepSeconds& seconds);
std::string summary(const BuiltScene& built, const RenderStats& stats, const StepSeconds& seconds);

} // namespace strobe
