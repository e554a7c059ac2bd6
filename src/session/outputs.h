// Output files: names, checks before rendering, and how images are written.
#pragma once

#include "core/film/film.h"
#include "session/log.h"
#include "session/options.h"

#include <set>

namespace strobe {

/// Throws Error of kind Usage if the color config has no such view. `threads`: see OutputSettings.
OutputSettings outputSettings(const ImageOptions& options, int threads);

/// Adds the view and the exposure of formats with a view, where they are not the default.
void addViewMetadata(const ImageOptions& options, Metadata& metadata);

/// Returns the options with an image name. Images that are given stay. Else it is `sceneOutput`, the output
/// name in the scene file, unless that is empty or the scene is restricted to some folders; else the stem of
/// the first scene file, in the current folder. Unsupported extensions become .exr, with a warning.
/// With noImage, the options do not change.
RenderOptions withDefaultImage(RenderOptions options, const std::string& sceneOutput, const Log& log);

/// Throws Error of kind Output if a file cannot be written, and of kind Usage if two of them are the same.
/// To be called before rendering. `makeFolders`: creates their folders.
void checkOutputFiles(const std::vector<std::filesystem::path>& files, bool makeFolders);
/// As above, for all files that a render writes.
void checkOutputFiles(const RenderOptions& options);
/// Throws Error of kind Output if an output is a file that the scene has read, by `policy`, or the reference.
void checkOutputsAreNotInputs(const RenderOptions& options, const ResourcePolicy& policy);

/// Throws Error of kind Usage if an output is one of the parts.
void checkOutputsAreNotInputs(const MergeOptions& options);

/// Warns if `clamped`, the number of values that were clamped to the largest half float, is not 0.
void warnOfClampedValues(const std::filesystem::path& image, size_t clamped, const Log& log);

/// Chooses the files of a render's unfinished images. An unfinished image replaces only an unfinished image
/// of this render, or one with at most as many samples.
class UnfinishedImages {
  public:
    explicit UnfinishedImages(const Log& log) : m_log(log) {}
    /// Returns `image`, or NAME.unfinished.EXT beside it if `image` exists and is to be kept, or none if the
    /// film has less than both, or if `image` is standard output. Logs the first time what is kept.
    std::optional<std::filesystem::path> fileFor(const std::filesystem::path& image, const Film& film);
    /// Removes the files NAME.unfinished.EXT of this render, as its images are finished.
    void removeSeparate();
    /// Adds the number of samples in the film, by which unfinished images are compared.
    static void addMetadata(const Film& film, Metadata& metadata);

  private:
    const Log& m_log;
    bool mayReplace(const std::filesystem::path& file, uint64_t samples) const;
    std::set<std::filesystem::path> m_separate, m_kept;
    std::set<std::filesystem::path> m_own; ///< files that this render has written, or is about to
};

} // namespace strobe
