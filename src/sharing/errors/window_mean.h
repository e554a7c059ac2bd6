// Means over windows of pixels.
#pragma once

#include "core/math/math.h"
#include "core/math/simd4.h"
#include "core/util/memory.h"

#include <cstdlib>
#include <vector>

namespace strobe {

/// Several numbers by pixel, row by row. All are averaged alike.
struct LanePlane {
    static constexpr int kLanes = 4;

    int width, height;
    HugeBuffer<float> values; ///< undefined until they are set
    LanePlane(int w, int h) : width(w), height(h), values(size_t(w) * size_t(h) * kLanes) {}
    /// Returns the lanes of a pixel.
    float* at(size_t pixel) { return values.data() + kLanes * pixel; }
    const float* at(size_t pixel) const { return values.data() + kLanes * pixel; }
    float* row(int y) { return at(size_t(y) * size_t(width)); }
    const float* row(int y) const { return at(size_t(y) * size_t(width)); }
    int rowSize() const { return kLanes * width; }
};

/// Returns the number of blocks along `pixels` pixels. `edge`: of a block, in pixels.
inline int blocksAlong(int pixels, int edge) { return (pixels + edge - 1) / edge; }

/// Returns the values of a plane of blocks at pixel (x, y), interpolated between the centers of the blocks.
/// `edge`: of a block, in pixels.
Float4 interpolateBlocks(const LanePlane& blocks, int x, int y, int edge);

/// Gaussian means over windows of pixels. Weights outside of the image are left out.
class WindowMean {
  public:
    /// `sigma`: the standard deviation in pixels.
    WindowMean(int width, int height, float sigma);
    /// Returns the sum of the squared weights of a wide window, whose weights sum to 1: the variance of a
    /// mean of independent numbers with a variance of 1.
    static constexpr float squaredWeights(float sigma) { return 1 / (4 * 3.14159265f * sigma * sigma); }
    /// Replaces the numbers of each pixel by the means around it. `scratch` has the size of the plane.
    void apply(LanePlane& plane, LanePlane& scratch) const;
    /// Returns the largest distance of pixels that have weight.
    int reach() const { return int(m_kernel.size()) - 1; }
    /// Returns the factor of the weight by a distance in x or y, at most `reach`.
    float weight(int distance) const { return m_kernel[size_t(std::abs(distance))]; }

  private:
    void averageRow(const float* in, int size, float* out) const;
    void averageColumns(const LanePlane& rows, int y, float* out) const;
    std::vector<float> inverseWeights(int length) const;

    const std::vector<float> m_kernel;         ///< by distance
    std::vector<float> m_inverseX, m_inverseY; ///< of the sums of weights; x: by lane, too
};

} // namespace strobe
