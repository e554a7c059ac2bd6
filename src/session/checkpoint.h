// What a render has done so far, in a file from which it can go on.
#pragma once

#include "session/fallback_writer.h"
#include "session/options.h"
#include "session/part_file.h"

namespace strobe {

/// What is in the film (which keeps sums) of the samples that the options ask for: the pixels that have them
/// all.
RenderPart partOf(const Film& film, const Options& options, const BuiltScene& built);

/// The part of a picture that is finished, beside its first output: OUTPUT.checkpoint.
class Checkpoint {
  public:
    /// Throws Error of kind Usage if there is one already but the options do not say --resume.
    Checkpoint(const Options& options, const BuiltScene& built);
    /// Fills the film with what is there; false: nothing is. Throws Error of kind Usage if it is damaged, or
    /// of another render.
    bool resume(Film& film) const;
    /// Where it belongs, or where `fallback` finds room.
    void save(const Film& film, FallbackWriter& fallback) const;
    /// When the picture is written.
    static void remove(const Options& options);

  private:
    const Options& m_options;
    const BuiltScene& m_built;
    const std::filesystem::path m_file;
};

} // namespace strobe
