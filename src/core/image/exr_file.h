// Writing of OpenEXR files. exr_file.cpp is the only file that includes OpenEXR.
#pragma once

#include "core/image/image.h"
#include "core/math/api.h"
#include "core/math/pixel_bounds.h"

namespace STROBE_API strobe {

/// Storage settings of EXR files.
struct ExrSettings {
    /// With the values of Imf::Compression.
    enum Compression { None, Rle, Zips, Zip, Piz, Pxr24, B44, B44a, Dwaa, Dwab };
    Compression compression = Zip;
    float dwaLevel = 45;                    ///< loss of Dwaa and Dwab; 0 is the smallest
    bool half = false;                      ///< store 16-bit floats, except in exact channels
    int tileSize = 0;                       ///< width and height of tiles in pixels; 0: scan lines
    bool isMultiPart = false;               ///< one part per layer; else all channels in a single part
    std::string colorSpace = kWorkingSpace; ///< name of the color space of the pixels
};

/// Parses comma-separated words: float or half; a compression, with an optional `:level` for dwaa and dwab;
/// scanlines or tiles, with an optional `:edge` (width and height of the tiles); single or parts. A later
/// word overrides an earlier one. Throws Error of kind Usage that lists the known words.
ExrSettings parseExrSettings(const std::string& words);

/// A channel of an output image, with one value per pixel.
struct ExrChannel {
    std::string name;                                 ///< full name: "R", "normal.X"
    std::variant<const float*, const uint32_t*> data; ///< integers are stored as integers
    size_t stride = 1;                                ///< distance between pixels, in values
    /// The channel is data, not light: floats are stored with 32 bits and without loss, whatever the
    /// settings.
    bool exact = false;
};

/// The channels of a layer. In a multi-part file, they form a part with this name.
struct ExrPart {
    std::string name;
    std::vector<ExrChannel> channels;
    Metadata metadata{}; ///< of this part; the metadata of the file are written to the first part
};

/// The windows of an image.
struct ImageFrame {
    PixelBounds dataWindow; ///< the stored pixels
    V2i resolution;         ///< of the full frame, which is the display window
};

/// Checks the arguments of writeExr before the pixels are available. Throws Error of kind Output if names of
/// parts or channels are empty or not unique, and of kind Usage if a lossy compression would change exact
/// channels in a single-part file.
void checkExr(const std::filesystem::path& path, const std::vector<ExrPart>& parts,
              const ExrSettings& settings);

/// Writes `parts`, which all have the pixels of frame.dataWindow, with writeFileAtomically. The attributes
/// `chromaticities`, `oiio:ColorSpace` and `colorInteropID` describe the working space. `oiio:ColorSpace` and
/// `colorInteropID` are "data" in parts that have only exact channels. In a multi-part file, parts with exact
/// channels are compressed with Zips if the compression in `settings` would change them.
///
/// Compresses with `threads` threads (0: one per core); the file does not depend on their number. They are
/// the threads of OpenEXR's global pool, so concurrent calls wait for each other.
///
/// Returns the number of finite values beyond the range of half floats, which are clamped to it. Throws Error
/// of kind Output, and the errors of checkExr.
size_t writeExr(const std::filesystem::path& path, const ImageFrame& frame, const std::vector<ExrPart>& parts,
                const Metadata& metadata, const ExrSettings& settings = {}, int threads = 1);

} // namespace strobe
