// Parts of a render in files: exact sums, which add up to the whole.
#pragma once

#include "core/film/film.h"
#include "core/render/integrator.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace strobe {

/// Which samples of which pixels.
struct SampleBox {
    PixelBounds pixelBounds;
    SampleSlice samples;
};

struct RenderPart {
    /// What must be the same for parts to belong together: names and values, for people too.
    std::vector<std::pair<std::string, std::string>> key;
    int fullWidth = 0, fullHeight = 0, samplesPerPixel = 0; ///< of the whole render
    std::vector<SampleBox> boxes;                           ///< what is here; no two overlap
    PixelBounds pixelBounds;                                ///< around them
    std::vector<PixelAccumulator> sums;                     ///< row by row over the window
};

/// By its name.
inline bool isPart(const std::filesystem::path& file) { return file.extension() == ".part"; }

/// A text line that says what it is, one with a checksum of the rest, one of JSON, then the sums. Atomic;
/// throws Error of kind Output.
void writePart(const std::filesystem::path& file, const RenderPart& part);
/// Throws Error of kind Usage if the file is no part, damaged or cut short.
RenderPart readPart(const std::filesystem::path& file);
/// The same of its bytes; `file` is for messages.
RenderPart parsePart(std::string_view bytes, const std::filesystem::path& file);

/// Puts `more` (named `file` in messages) together with `part`. Throws Error of kind Usage if it belongs to
/// another render, or has samples that are there already.
void addPart(RenderPart& part, const RenderPart& more, const std::filesystem::path& file);

/// How many samples are missing in the frame's window around the boxes: 0 if every pixel there has all.
uint64_t missingSamples(const RenderPart& part);

} // namespace strobe
