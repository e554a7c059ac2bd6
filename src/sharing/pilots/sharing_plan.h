// A decision before the render: which parts of the light to share.
#pragma once

#include "sharing/emission/emission_refinement.h"
#include "sharing/pilots/pair_pilot.h"

#include <optional>

namespace strobe {

/// An estimate of the time of sharing, relative to that of a render that shares nothing and has the same
/// number of samples in all pixels.
struct SharingOverhead {
    double ofSamples = 0; ///< recording: grows with the number of samples
    double ofPixels = 0;  ///< reconstruction
    /// Returns the time of a render that shares, in the same unit. `samples`: the time of its samples.
    double timeOf(double samples) const { return samples * (1 + ofSamples) + ofPixels; }
};

/// How the light of a render is shared.
struct SharingPlan {
    LightParts parts;         ///< the parts of the light to share
    SharingOverhead overhead; ///< 0 if nothing is shared
    RareLimits rareLimits;
    std::optional<EmissionPilot> emission; ///< none: EmissionRefinement would gain little
    /// See sharingBytes. If nothing is shared: those that exceeded SharingOptions::memoryLimit, or 0.
    size_t bytes = 0;
};

/// What the user chose.
struct SharingOptions {
    float cellSize = 3;               ///< edge of the cells that sum light, in pixels
    std::optional<LightParts> chosen; ///< the parts to share in any case; none: as the pilot decides
    bool adaptsSamples = false;       ///< planSamples follows
    size_t memoryLimit = SIZE_MAX;    ///< in bytes; nothing is shared if that would take more
};

/// Returns about how many bytes sharing takes beyond a render that shares nothing, at the peak of its memory.
/// `cellsPerPixel`: that are recorded. Where samples adapt, there may be more cells.
size_t sharingBytes(const RenderContext& context, double cellsPerPixel);

/// Renders blocks of pixels, usually less than 1 % of the samples, and reconstructs their light. Their errors
/// decide which parts are shared (decideSharing). Blocks with more noise in `pairs` are chosen with a larger
/// probability (BlockChooser). No block is rendered where no pair has noise, unless options.chosen is set. At
/// least 2 samples per pixel. The result does not depend on the seed, on slices of the samples or on measured
/// times.
SharingPlan planSharing(const Scene& scene, const RenderContext& context, const PairPilot& pairs,
                        const SharingOptions& options);
} // namespace strobe
