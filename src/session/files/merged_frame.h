// The sum of parts of one render.
#pragma once

#include "core/render/light_film.h"
#include "session/files/part_file.h"

namespace strobe {

/// Adds up parts one after another. Memory: that of the frame, however many parts there are.
class MergedFrame {
  public:
    /// `header`: of the sum of the parts; outlives the frame.
    explicit MergedFrame(const PartHeader& header);
    /// Adds a part. Throws what PartReader::read throws, and Error of kind Usage if its AOVs are damaged.
    void add(PartReader& part);
    /// The samples, and the records of the integrator.
    Film& film() { return m_film; }
    const Film& film() const { return m_film; }
    const AovSums* surfaces() const { return m_surfaces ? &*m_surfaces : nullptr; }
    const LightFilm* lights() const { return m_lights ? &*m_lights : nullptr; }
    /// Writes the sum as a part. Throws Error of kind Output.
    void writePart(const std::filesystem::path& file) const;
    /// Returns how many samples the pixels of the header's bounds lack in all, of those per pixel that the
    /// header says.
    uint64_t missingSamples() const;

  private:
    const PartHeader& m_header;
    Film m_film;
    std::optional<AovSums> m_surfaces;
    std::optional<LightFilm> m_lights;
};

/// Returns the number of invalid samples of all pixels.
uint64_t invalidSamples(const std::vector<PixelAccumulator>& sums);

} // namespace strobe
