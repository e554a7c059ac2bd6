// The render loop: tiles over threads, five steps per batch of pixels.
#pragma once

#include "core/film.h"
#include "core/integrator.h"

#include <functional>

namespace strobe {

/// What became of one visibility sample.
struct SampleReport {
    int x, y;        ///< pixel
    uint32_t number; ///< in its pixel
    const VisibilitySample& sample;
    Rgb value;      ///< radiance, filter weight not included
    uint64_t block; ///< see IntegratorWorker::blockOf
    uint32_t asked; ///< shades that were made because of it
};

struct RenderSettings {
    int samplesPerPixel = 1;
    uint64_t seed = 0;
    int threads = 0;   ///< 0: as many as the machine has
    int tileSize = 32; ///< pixels; changes the time, never a pixel
    /// Called now and then, from any thread but one at a time, with the fraction done.
    std::function<void(double)> progress;
    /// Called for every sample, from any thread: to look into pixels. Leave empty otherwise.
    std::function<void(const SampleReport&)> probe;
};

struct RenderStats {
    Counters total;
    std::vector<Counters> threads;
    double seconds = 0; ///< wall clock
};

/// Renders the film's window. A pixel is a function of scene, shader, integrator, sampler, filter, seed and
/// its own coordinates: not of window, tiles or threads.
RenderStats render(const Scene& scene, const Integrator& integrator, const Shader& shader,
                   const Sampler& sampler, const Filter& filter, const RenderSettings& settings, Film& film);

} // namespace strobe
