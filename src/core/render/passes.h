// Pictures made pass by pass: until time is up, until noise is low enough, or to be watched while they grow.
#pragma once

#include "core/film/noise.h"
#include "core/render/render.h"

namespace strobe {

struct PassGoal {
    using Clock = std::chrono::steady_clock;
    /// The last pass ends before; but the first pass is made in any case.
    std::optional<Clock::time_point> deadline;
    /// Goes on until NoiseEstimate::level is not above this.
    std::optional<double> noise;
};

/// Called after each pass with the picture so far and what it took. The deadline that it returns, if any,
/// counts from then on.
using PassDone = std::function<std::optional<PassGoal::Clock::time_point>(const Film&, const RenderStats&)>;

/// Independent passes, each with a seed and a cache of its own; the picture is the mean of their samples.
/// With a noise to reach, each has settings.samplesPerPixel; with a deadline alone, they grow by
/// fours (in few passes, samples are well spread and shades well shared) up to `most`, and shrink when time
/// runs out. A pass that the deadline or settings.stop finds unfinished is left out, but for the first: all
/// pixels have equally many samples.
/// Tiles are shown (settings.onTileDone) in the first pass only. Makes the film keep sums; fills its layer
/// Variance, if it has that, where there is a noise to reach.
RenderStats renderPasses(const Scene& scene, const Integrator& integrator, const Shader& shader,
                         const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                         const PassGoal& goal, int most, Film& film, const PassDone& done);

/// The render of these settings, to the bit, in passes over the window that each double the samples. Makes
/// the film keep sums. Throws Error if the integrator's samples cannot be sliced.
RenderStats renderDoubling(const Scene& scene, const Integrator& integrator, const Shader& shader,
                           const Sampler& sampler, const Filter& filter, const RenderSettings& settings,
                           Film& film, const PassDone& done);

} // namespace strobe
