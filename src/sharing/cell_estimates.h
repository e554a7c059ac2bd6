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
    float light[1 + kFitScales][kLightChannels];
    /// `estimate`: 0 for the mean, then the fits by scale.
    Rgb at(int estimate, LightPart part, int half) const {
        const float* rgb = &light[estimate][channelOf(int(part), half)];
        return {rgb[0], rgb[1], rgb[2]};
    }
};

/// Returns the width of the region of a fit in edges of recorded cells.
float fitWidth(int scale);

/// Returns the estimates of all recorded cells.
std::vector<CellEstimate> estimateCells(const CellPyramid& pyramid);

} // namespace strobe
