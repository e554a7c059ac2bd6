// Estimates of light at cells: local linear fits.
#pragma once

#include "sharing/cell_pyramid.h"

namespace strobe {

/// The number of sizes of fits: each is twice as large as the one before.
inline constexpr int kFitScales = 2;

/// The light of all parts and both halves as linear functions of the position and the normal on a surface.
struct LightFit {
    /// The value at the node, and the derivatives by two tangents of the position (per radius of the fit) and
    /// of the normal.
    static constexpr int kTerms = 5;
    float terms[kTerms][kLightChannels];
};

/// The estimates of the light at a recorded cell from each half: the mean of its samples, then the fits by
/// scale.
struct CellEstimate {
    static constexpr int kCount = 1 + kFitScales;
    static constexpr int kLanes = kCount + 1; ///< LightSharing keeps the pixel's own light in the last one
    alignas(16) float light[kParts][kHalves][3][kLanes] = {};

    /// `estimate`: 0 for the mean, then the fits by scale.
    Rgb at(int estimate, LightPart part, int half) const {
        const auto& rgb = light[int(part)][half];
        return {rgb[0][estimate], rgb[1][estimate], rgb[2][estimate]};
    }
    /// Sets an estimate for all parts and halves.
    void set(int estimate, const float (&channels)[kLightChannels]) {
        for (int part = 0; part < kParts; ++part)
            for (int half = 0; half < kHalves; ++half)
                for (int c = 0; c < 3; ++c)
                    light[part][half][c][estimate] = channels[channelOf(part, half) + c];
    }
};

/// Returns the width of the region of a fit in edges of recorded cells.
float fitWidth(int scale);

/// Returns the estimates of all recorded cells. `cellsByNode`: those of the pyramid.
HugeBuffer<CellEstimate> estimateCells(const CellPyramid& pyramid, std::span<const uint32_t> cellsByNode);

} // namespace strobe
