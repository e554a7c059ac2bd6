// OpenEXR files: the one file that knows OpenEXR.
#pragma once

#include "core/image/image.h"
#include "core/math/pixel_bounds.h"

namespace strobe {

/// How EXR files are stored.
struct ExrSettings {
    /// In the order of Imf::Compression.
    enum Compression { None, Rle, Zips, Zip, Piz, Pxr24, B44, B44a, Dwaa, Dwab };
    Compression compression = Zip;
    float dwaLevel = 45;                    ///< of Dwaa and Dwab: what may be lost; 0 is least
    bool half = false;                      ///< 16-bit floats, where a channel does not forbid it
    int tile = 0;                           ///< edge of the tiles in pixels; 0: scan lines
    bool parts = false;                     ///< a part for each layer, else all layers' channels in one
    std::string colorSpace = kWorkingSpace; ///< the name of the pixels' color space
};

/// Settings from words with commas between: float or half; a compression, for the last two with `:level`;
/// scanlines or tiles, which may have `:edge`; single or parts. The last of several that exclude each other
/// counts. Throws Error of kind Usage that lists the known words.
ExrSettings parseExrSettings(const std::string& words);

/// One named channel of an output image: the full name ("R", "normal.X"), and a value for each pixel.
struct ExrChannel {
    std::string name;
    std::variant<const float*, const uint32_t*> data; ///< integers are stored as integers
    size_t stride = 1;                                ///< in values, between pixels
    bool exact = false; ///< floats that keep all their bits, whatever the settings: numbers, not light
};

/// Channels that belong together. Multi-part files have a part of this name for them.
struct ExrPart {
    std::string name;
    std::vector<ExrChannel> channels;
    Metadata metadata{}; ///< of this part; that of the whole file stands in the first
};

/// Where the pixels of a file lie.
struct ImageFrame {
    PixelBounds data; ///< whose pixels are stored
    V2i resolution;   ///< of the whole frame, the display window
};

/// Throws Error of kind Output for names that repeat or are empty, and of kind Usage for exact channels in a
/// single part with a compression that would change them. To be asked before there are pixels.
void checkExr(const std::filesystem::path& path, const std::vector<ExrPart>& parts,
              const ExrSettings& settings);

/// Writes `parts`, all over the same pixels, to a temporary file beside `path` and renames it: there is
/// never a half-written file under the final name. Chromaticities, `oiio:ColorSpace` and `colorInteropID`
/// name the working space, or say "data" for parts of exact channels alone. In a multi-part file, a part with
/// exact channels is compressed by Zips where `settings` say a compression that would change them. Returns
/// how many finite values were beyond what half floats hold and became their largest. The file is the same
/// whatever `threads` (0: one per core) compress it; they are OpenEXR's, of which a process has one set: one
/// file waits for another. Throws Error of kind Output, also for what checkExr throws for.
size_t writeExr(const std::filesystem::path& path, const ImageFrame& frame, const std::vector<ExrPart>& parts,
                const Metadata& metadata, const ExrSettings& settings = {}, int threads = 1);

} // namespace strobe
