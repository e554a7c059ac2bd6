// Checkpoints: the finished pixels of a render, in a file from which the render can continue.
#pragma once

#include "core/util/file_lock.h"
#include "session/aov_recorder.h"
#include "session/fallback_writer.h"
#include "session/files/part_file.h"
#include "session/frame.h"

namespace strobe {

/// Returns the header of a part of the pixels of the film that have all samples of the job. The film keeps
/// sums. `layout`: of the AOVs in the film's layer records.
PartHeader partHeaderOf(const Film& film, const FrameJob& job, const BuiltScene& built,
                        const AovLayout& layout);
/// Writes these pixels, their records and their AOVs. `part`: as partHeaderOf returns it; it has boxes. The
/// file is replaced atomically. Throws Error of kind Output.
void writePart(const std::filesystem::path& file, const PartHeader& part, const Film& film);

/// The checkpoint of a render: a part in the file OUTPUT.checkpoint, OUTPUT being the first image.
class Checkpoint {
  public:
    /// Throws Error of kind Usage if the integrator cannot continue a render, if another process has the
    /// checkpoint of this output, or if the file exists and the options do not say to resume. `job` and
    /// `built` outlive the checkpoint.
    Checkpoint(const FrameJob& job, const BuiltScene& built, AovLayout layout);
    /// Adds the saved pixels, records and AOVs to the film, which keeps sums. Returns false if there is no
    /// file. Throws Error of kind Usage if the file is damaged or of another render.
    bool resume(Film& film) const;
    /// Writes the finished pixels of the film to the file, or to a fallback folder. Does nothing if there are
    /// none.
    void save(const Film& film, FallbackWriter& fallback) const;
    /// Whether there is a file from which the render of the job can continue.
    static bool exists(const FrameJob& job);
    /// Removes the file, if there is one.
    static void remove(const FrameJob& job);

  private:
    void checkHeader(const PartHeader& saved, const Film& film) const;

    const FrameJob& m_job;
    const BuiltScene& m_built;
    const AovLayout m_layout;
    const std::filesystem::path m_file;
    const FileLock m_lock; ///< of m_file
};

} // namespace strobe
