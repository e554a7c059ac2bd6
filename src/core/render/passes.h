// Progressive rendering: passes until a deadline or a noise target, or with a growing number of samples.
#pragma once

#include "core/film/noise.h"
#include "core/math/api.h"
#include "core/render/render.h"

namespace STROBE_API strobe {

/// The goal of a render in passes. At least one member is set.
struct PassGoal {
    using Clock = std::chrono::steady_clock;
    /// No pass but the first continues after it.
    std::optional<Clock::time_point> deadline;
    /// Passes continue until the noise level is at most this: that of the errors that Renderer::finish
    /// estimates, otherwise NoiseEstimate::level.
    std::optional<double> noise;
};

/// Called with the finished film and the statistics so far: after the first and the last pass. After others,
/// the film is finished as long as Renderer::finish takes a small part of the time, or, with a noise target,
/// where the errors that it estimates may have reached the target. Returns a new deadline, e.g. one that
/// leaves time to write the image, or nothing to keep the previous one.
using PassDone = std::function<std::optional<PassGoal::Clock::time_point>(const Film&, const RenderStats&)>;

/// Renders independent passes, each with a seed and caches of its own, and accumulates them in the film.
///
/// With goal.noise, each pass has settings.samplesPerPixel samples per pixel, but at least
/// Integrator::fewestSamplesOfPass. With a deadline alone, the first pass has the latter, at most
/// `maxSamples`; the next ones grow by factors of four up to `maxSamples` (fewer passes stratify samples and
/// share shades better), and shrink to fit the time that is left. A pass that is interrupted by the deadline
/// or by settings.stop is discarded, so all pixels have equally many samples; the first pass is never
/// interrupted.
///
/// settings.onTileDone is called in the first pass only. The film is made to accumulate; its layer
/// Aov::Variance, if any, is set if there is a noise target.
RenderStats renderPasses(const Scene& scene, const Integrator& integrator, const Shader& shader,
                         const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                         const PassGoal& goal, int maxSamples, Film& film, const PassDone& done);

/// Renders the same image as `render`, to the bit, in passes that each double the number of samples. The film
/// is made to accumulate. Throws Error if the integrator's samples cannot be rendered in slices.
RenderStats renderDoubling(const Scene& scene, const Integrator& integrator, const Shader& shader,
                           const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                           Film& film, const PassDone& done);

} // namespace strobe
