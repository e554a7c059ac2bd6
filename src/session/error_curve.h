// How far the picture is from a reference while it is rendered.
#pragma once

#include "core/render/render.h"

#include <filesystem>
#include <string>
#include <vector>

namespace strobe {

class ErrorCurve {
  public:
    /// Reads the reference: an image as large as the frame, or as the window that is rendered. Throws Error
    /// of kind Usage for another size, or if it cannot be read.
    ErrorCurve(const std::filesystem::path& reference, const Film& film);

    /// Root mean squares over pixels and channels of values cut to [0,1], what a display shows; relative:
    /// of (value - truth) / (truth + 0.01).
    struct Point {
        double seconds; ///< of rendering
        uint64_t samplesPerPixel;
        double rmse, relative;
    };
    const Point& add(const Film& film, const RenderStats& stats);
    /// CSV with a header: seconds, samples, rmse, relative_rmse. Throws Error of kind Output.
    void write(const std::filesystem::path& file) const;

  private:
    Image m_reference; ///< of the window
    std::vector<Point> m_points;
};

} // namespace strobe
