// Estimates of light at cells: local linear fits.
#pragma once

#include "sharing/cell_pyramid.h"

namespace strobe {

/// The number of sizes of fits: each is twice as large as the one before.
inline constexpr int kFitScales = 2;

/// The estimates of one part of the light at a recorded cell from each half: the mean of its samples, then
/// the fits by scale.
struct CellEstimate {
    static constexpr int kCount = 1 + kFitScales;
    static constexpr int kLanes = kCount + 1; ///< LightSharing keeps the pixel's own light in the last one
    alignas(16) float light[kHalves][3][kLanes] = {};

    /// `estimate`: 0 for the mean, then the fits by scale.
    Rgb at(int estimate, int half) const {
        const auto& rgb = light[half];
        return {rgb[0][estimate], rgb[1][estimate], rgb[2][estimate]};
    }
    /// Sets an estimate of both halves. `channels`: as those of NodeLight.
    void set(int estimate, const float* channels) {
        for (int half = 0; half < kHalves; ++half)
            for (int c = 0; c < 3; ++c)
                light[half][c][estimate] = channels[3 * half + c];
    }
};

/// The estimates of all recorded cells.
struct CellEstimates {
    HugeBuffer<CellEstimate> parts[kParts]; ///< by cell; empty: the part was not recorded
};

/// Returns the width of the region of a fit in edges of recorded cells.
float fitWidth(int scale);

/// Returns the estimates of all recorded cells. `cellsByNode`: those of the pyramid.
CellEstimates estimateCells(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode);

} // namespace strobe
