// The texels of MIP levels in memory: their places, and their computation from an image.
#pragma once

#include "core/image/texel_codec.h"
#include "core/image/texel_memory.h"

namespace strobe {

/// The places of texels in memory, by MIP level.
struct MipLayout {
    /// Texel (x, y) of a level has index first + (y / 64) tileRowStep + (x / 64) tileStep + (y % 64) rowStep
    /// + x % 64.
    struct Level {
        int width, height;
        int32_t first, tileRowStep, tileStep, rowStep;
        int32_t index(int x, int y) const {
            return first + (y >> 6) * tileRowStep + (x >> 6) * tileStep + (y & 63) * rowStep + (x & 63);
        }
    };
    std::vector<Level> levels; ///< the finest first
    size_t texels = 0;         ///< of all levels, with padding

    /// Appends a level: in tiles of 64x64 texels, so that neighbors are near in memory, or row by row.
    void add(int width, int height, bool isTiled);
    /// Returns the tiled levels of an image down to a single texel; each has half the size of the one before,
    /// rounded down.
    static MipLayout halving(int width, int height);
};

/// The part of an image file that a texture uses, and the encoding of its values.
struct TexelSource {
    ImageReader& file;
    int firstChannel, channels; ///< 1 or 3
    ColorEncoding encoding;
};

/// Writes all MIP levels of an image to `texels`, as codes of `codec`. Levels that the file has are taken as
/// they are; the others are means of the area of the level before, rounded once. Returns false on failure.
/// Sets `hasInvalidValues` if a value of the finest level is NaN or infinite.
bool writeMipLevels(const TexelSource& source, const MipLayout& layout, const TexelCodec& codec,
                    TexelMemory& texels, bool& hasInvalidValues, std::string& error);

} // namespace strobe
