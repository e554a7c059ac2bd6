// Every visibility sample of a render as a table, to look into pixels.
#pragma once

#include "core/render/render.h"

#include <filesystem>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

namespace strobe {

class SampleTable {
  public:
    /// From any thread.
    void add(const SampleRecord& report);
    /// CSV with a header, by row of pixels, column and sample: x, y, sample, film_x, film_y, time (shutter
    /// fraction), instance, geometry, primitive (empty where nothing was met), cell (0: not shared), shades
    /// (those that it requested), r, g, b. Throws Error of kind Output.
    void write(const std::filesystem::path& file);

  private:
    using Place = std::tuple<int, int, uint32_t>;
    std::mutex m_mutex;
    std::vector<std::pair<Place, std::string>> m_rows;
};

} // namespace strobe
