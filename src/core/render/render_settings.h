// Settings and statistics of a render.
#pragma once

#include "core/film/film.h"
#include "core/render/aov_film.h"
#include "core/render/light_film.h"

#include <functional>
#include <optional>

namespace strobe {

/// One visibility sample and its value, for RenderSettings::onSample.
struct SampleRecord {
    int x, y;        ///< pixel
    uint32_t number; ///< in its pixel
    const VisibilitySample& sample;
    Rgb value;          ///< radiance, without the filter weight
    uint64_t sharingId; ///< see IntegratorWorker::sharingId
    uint32_t shades;    ///< shades that it requested
};

struct RenderSettings {
    int samplesPerPixel = 1;
    /// The samples of each pixel to render; none: all. The sums of disjoint slices add up to the sums
    /// of the whole render, to the bit.
    std::optional<SampleSlice> slice;
    /// Disjoint rectangles within the film's pixel bounds: the pixels to render; empty: all. If there are
    /// any, IntegratorState::finish is not called: the film lacks pixels.
    std::vector<PixelBounds> regions;
    /// True if this render is one of several passes of the same pixels; their number is not known.
    bool isPass = false;
    /// The samples per pixel of earlier passes of the same pixels.
    uint64_t samplesBefore = 0;
    /// Skips tiles whose pixels have all these samples already and renders the others anew. The film must
    /// accumulate.
    bool resume = false;
    uint64_t seed = 0;
    /// The pixels from which an integrator with a pilot decides; none: those of the render. Renders of parts
    /// of a frame decide alike if all of them have the bounds of the frame.
    std::optional<PixelBounds> pilotBounds;
    /// Samples with a channel above this are scaled down to it. Biased; 0: off. Samples that are not finite
    /// stay.
    float clamp = 0;
    int threads = 0;   ///< 0: one per core
    int tileSize = 32; ///< pixels; changes the time, never a pixel
    /// Called now and then with the fraction done; from any thread, one at a time.
    std::function<void(double)> onProgress;
    /// Called for every sample, from any thread. Slow: leave empty otherwise.
    std::function<void(const SampleRecord&)> onSample;
    /// Called from any thread when a tile is in the film. No other thread writes to this tile.
    std::function<void(const Film&, const PixelBounds&)> onTileDone;
    /// Called from any thread, about every thousand samples. Once it returns true, the rest is skipped.
    std::function<bool()> stop;
    /// Gathers AOVs of the visible surfaces, over the film's pixel bounds; null: none.
    AovFilm* aovs = nullptr;
    /// Gathers components of the light, over the film's pixel bounds; null: none.
    LightFilm* lights = nullptr;
    /// Adds `aovs` and `lights` to the film's layer records, tile by tile. The film must accumulate.
    bool recordsLayers = false;

    LightComponents lightComponents() const { return lights ? lights->components() : LightComponents{}; }
};

/// Returns the samples of the AOVs in `tile`, as bytes. `aovs` and `lights` may be null.
inline std::string storeLayers(const PixelBounds& tile, const AovSums* aovs, const LightFilm* lights) {
    std::string bytes;
    if (aovs)
        aovs->store(tile, bytes);
    if (lights)
        lights->store(tile, bytes);
    return bytes;
}
/// Adds what `storeLayers` returned for the same AOVs. Throws Error of kind Usage if the record is damaged.
inline void loadLayers(const FilmRecord& record, AovSums* aovs, LightFilm* lights) {
    std::string_view bytes = record.bytes.view();
    if ((aovs && !aovs->load(record.pixels, bytes)) || (lights && !lights->load(record.pixels, bytes)) ||
        !bytes.empty())
        throw Error("the AOVs of a tile are damaged", ErrorKind::Usage);
}

struct RenderStats {
    Counters total;
    std::vector<Counters> threads;
    // Wall clock:
    double seconds = 0;
    double beginSeconds = 0, finishSeconds = 0; ///< of these, Integrator::begin and IntegratorState::finish
    int passes = 0;                             ///< over all pixels
    uint64_t samplesPerPixel = 0;
    std::optional<double> noise; ///< see PassGoal::noise; if it was estimated
    std::string integratorNote;  ///< IntegratorState::note
};

} // namespace strobe
