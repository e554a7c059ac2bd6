// The parts of a merge: whether they belong together, and what they lack.
#pragma once

#include "session/files/part.h"

namespace strobe {

/// The headers of parts of one render that have no sample in common.
class PartList {
  public:
    /// Reads the headers. Of parts of different renders, those of the render with the most parts are meant.
    /// Throws Error of kind Usage, which names all files that cannot be read, that are parts of other
    /// renders, or that have samples of another file. `allowMissing`: files that do not exist are left out,
    /// unless none exists.
    PartList(const std::vector<std::filesystem::path>& files, bool allowMissing);

    /// The files to merge.
    const std::vector<std::filesystem::path>& files() const { return m_files; }
    /// The files that were left out.
    const std::vector<std::filesystem::path>& absent() const { return m_absent; }
    /// The header of the sum of all parts.
    const PartHeader& merged() const { return m_merged; }
    /// Whether any part has some of the samples of its pixels only.
    bool hasSlicesOfSamples() const;

  private:
    std::vector<std::filesystem::path> m_files, m_absent;
    PartHeader m_merged;
};

/// Returns "slices 3, 7-9 of 16 are missing" for the slices that a part lacks; empty if it lacks none, or was
/// not divided by slices.
std::string missingSlices(const PartHeader& part);

} // namespace strobe
