// Part files: exact sums and records of some samples of some pixels, which add up to the whole render.
#pragma once

#include "core/film/aov_sums.h"
#include "core/film/film.h"
#include "core/render/integrator.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace strobe {

/// The same samples of all pixels of a rectangle.
struct SampleBox {
    PixelBounds pixelBounds;
    SampleSlice samples;
};

struct RenderPart {
    /// Names and values of all that affects the image. Parts of one render have equal keys.
    std::vector<std::pair<std::string, std::string>> key;
    /// Names and hashes of files of the scene, to tell what differs between scenes.
    std::vector<std::pair<std::string, uint64_t>> files;
    int fullWidth = 0, fullHeight = 0;  ///< of the frame, pixels
    int samplesPerPixel = 0;            ///< of the whole render
    std::vector<SampleBox> boxes;       ///< the samples of this part; disjoint
    PixelBounds pixelBounds;            ///< contains the boxes
    std::vector<PixelAccumulator> sums; ///< row by row over pixelBounds
    std::vector<FilmRecord> records;    ///< of samples of the boxes
    AovLayout layout;                   ///< of the AOVs
    std::vector<FilmRecord> layers;     ///< the AOVs of samples of the boxes: see storeLayers

    /// Returns the value of a name of the key; empty if there is none.
    std::string keyValue(const std::string& name) const;
    /// The name in the key of FilmRecords::note.
    static constexpr const char* kNote = "integratorNote";
    /// The name in the key of the hash of the scene.
    static constexpr const char* kScene = "scene";
};

/// Whether a file with this name is a part.
inline bool isPart(const std::filesystem::path& file) { return file.extension() == ".part"; }

/// Writes a line with the format and version, a line with a checksum of the rest, a line of JSON, the sums,
/// the records and the AOVs. The file is replaced atomically. Throws Error of kind Output.
void writePart(const std::filesystem::path& file, const RenderPart& part);
/// Throws Error of kind Usage if the file cannot be read, is not a part, is damaged or truncated.
RenderPart readPart(const std::filesystem::path& file);
/// Parses the bytes of a file. `file` names it in errors, which are those of readPart.
RenderPart parsePart(std::string_view bytes, const std::filesystem::path& file);

/// Adds the samples, the records and the AOVs of `more` to `part`. `file` names `more` in errors. Throws
/// Error of kind Usage if the parts are of different renders, or have samples in common.
void addPart(RenderPart& part, const RenderPart& more, const std::filesystem::path& file);

/// Adds the sums and the records to a film whose pixel bounds contain those of the part. The film keeps sums,
/// unless it is empty. Sets the note of the film's records.
void addToFilm(const RenderPart& part, Film& film);

/// Returns how many samples the pixels of `pixelBounds` lack in all.
uint64_t missingSamples(const RenderPart& part);
/// Returns the number of invalid samples of all pixels.
uint64_t invalidSamples(const std::vector<PixelAccumulator>& sums);

} // namespace strobe
