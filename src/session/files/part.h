// Parts of renders: exact sums and records of some samples of some pixels, which add up to the whole render.
#pragma once

#include "core/film/aov_sums.h"
#include "core/math/interleaved_tiles.h"
#include "core/math/sample_slice.h"

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace strobe {

/// The same samples of all pixels of a rectangle.
struct SampleBox {
    PixelBounds pixelBounds;
    SampleSlice samples;
};

/// Some slices of a render: see InterleavedTiles.
struct PartSlices {
    InterleavedTiles tiles;
    std::vector<uint32_t> numbers; ///< from 0 on, in ascending order
};

/// The header of a part: its render, its pixels, its samples and its layers, without their values.
struct PartHeader {
    /// Names and values of all that affects the image. Parts of one render have equal keys.
    std::vector<std::pair<std::string, std::string>> key;
    /// Names and hashes of files of the scene, to tell what differs between scenes.
    std::vector<std::pair<std::string, uint64_t>> files;
    int fullWidth = 0, fullHeight = 0; ///< of the frame, pixels
    int samplesPerPixel = 0;           ///< of the whole render
    PixelBounds pixelBounds;           ///< contains the boxes
    std::vector<SampleBox> boxes;      ///< the samples of this part; disjoint
    std::optional<PartSlices> slices;  ///< the slices that the part has; none: it is not of --slice
    AovLayout layout;                  ///< of the AOVs

    /// Returns the value of a name of the key; empty if there is none.
    std::string keyValue(const std::string& name) const;
    /// The name in the key of FilmRecords::note.
    static constexpr const char* kNote = "integratorNote";
    /// The name in the key of the hash of the scene.
    static constexpr const char* kScene = "scene";
    /// The names in the key of the number and the key of a sequence's frame: see FrameJob.
    static constexpr const char *kFrame = "frame", *kFrameKey = "frameKey";
};

/// Whether a file with this name is a part.
inline bool isPart(const std::filesystem::path& file) { return file.extension() == ".part"; }

/// Returns which files of two scenes differ, as "a.ply has changed, b.ply is new". `before` and `now`: as
/// PartHeader::files.
std::string changedFiles(const std::vector<std::pair<std::string, uint64_t>>& before,
                         const std::vector<std::pair<std::string, uint64_t>>& now);

/// Returns why `more` is not of the render of `part`: "it is a part of …"; empty if it is.
std::string differenceOf(const PartHeader& part, const PartHeader& more);

/// Whether a header does not contradict itself, and its sizes are within limits.
bool isConsistent(const PartHeader& part);
/// Whether samples of a rectangle of pixels lie within the bounds of a part.
bool isWithin(const PartHeader& part, const PixelBounds& pixels, const SampleSlice& samples);

/// Intervals of pixels in the rows of the bounds of a part, in ascending order: those of its boxes, each
/// pixel once.
class CoveredPixels {
  public:
    explicit CoveredPixels(const PartHeader& part);
    /// Calls work(x0, x1) for the intervals of row y.
    template <class Work>
    void forRow(int y, const Work& work) const {
        for (const auto& [x0, x1] : m_rows[size_t(y - m_firstRow)])
            work(x0, x1);
    }
    /// Returns the number of pixels of a row.
    size_t countOf(int y) const;

  private:
    int m_firstRow;
    std::vector<std::vector<std::pair<int, int>>> m_rows;
};

} // namespace strobe
