// CSV tables: every visibility sample of a render, and its error against a reference.
#pragma once

#include "core/render/render.h"

#include <filesystem>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

namespace strobe {

/// A table of visibility samples.
class SampleTable {
  public:
    /// Adds a row. Thread-safe.
    void add(const SampleRecord& record);
    /// Writes CSV with a header, sorted by y, x and sample: x, y, sample, film_x, film_y, time (shutter
    /// fraction), instance, geometry, primitive (empty for missed rays), cell (0: not shared), shades
    /// (requested by the sample), r, g, b (radiance). Throws Error of kind Output.
    void write(const std::filesystem::path& file);

  private:
    using Key = std::tuple<int, int, uint32_t>; ///< y, x, sample
    std::mutex m_mutex;
    std::vector<std::pair<Key, std::string>> m_rows;
};

/// A table of the error against a reference image, measured while rendering.
class ErrorCurve {
  public:
    /// Reads the reference. It has the size of the frame or of the film's pixel bounds. Throws Error of kind
    /// Usage for another size, or if it cannot be read.
    ErrorCurve(const std::filesystem::path& reference, const Film& film);

    struct Point {
        double seconds; ///< of rendering
        uint64_t samplesPerPixel;
        double rmse;     ///< root mean square over pixels and channels of values clamped to [0, 1]
        double relative; ///< the same for (value - reference) / (reference + 0.01)
    };
    const Point& add(const Film& film, const RenderStats& stats);
    /// Writes CSV with a header: seconds, samples, rmse, relative_rmse. Throws Error of kind Output.
    void write(const std::filesystem::path& file) const;

  private:
    Image m_reference; ///< over the film's pixel bounds
    std::vector<Point> m_points;
};

} // namespace strobe
