// The format of the records of TileLight: a header with the format, the parts and the cells, then the
// additional samples of emission, then the pixels by row.
#pragma once

#include "sharing/records/tile_light.h"

namespace strobe::tile_light_format {

/// The version of the format. Readers refuse records of other versions.
inline constexpr uint32_t kFormat = 5;
inline constexpr uint32_t kMaxSamples = PixelAccumulator::kMaxSamples;
inline constexpr size_t kSumsOfHalf = 1 + 3 * kParts * kQuarters;
/// The size of each sum of a half of which any sum exceeds 64 bits, in bytes. Other sums have 8 bytes.
inline constexpr size_t kLongSum = sizeof(__int128);
// The maximum numbers of bytes:
inline constexpr size_t kCellBytes = sizeof(CellSums) + 1, kEmissionBytes = 5 * kLongSum;
inline constexpr size_t kHalfBytes =
    1 + (2 + 2 * kQuarters) * sizeof(uint32_t) + kSumsOfHalf * kLongSum + kEmissionBytes;
// The exact ones:
inline constexpr size_t kUseBytes = sizeof(uint32_t) + 3 * sizeof(int64_t),
                        kRareBytes = 6 + 6 * sizeof(float);
/// The minimum number of bytes of a cell.
inline constexpr size_t kMinCellBytes = 81;
/// The rows of pixels are preceded by a table of the ends of rows.
using RowEnd = uint64_t;

/// Flags of one half of a pixel's samples: which numbers of the half are in the record. A half without
/// samples has no flag.
enum HalfFlags : uint8_t {
    kHasSamples = 1,
    kHasLongSums = 2,
    kHasEmission = 4,
    kHasRare = 8,
    kHasNegative = 16
};

inline size_t pixelCount(const PixelBounds& bounds) {
    return size_t(bounds.width()) * size_t(bounds.height());
}

inline size_t countOf(LightParts parts) {
    return size_t(parts.has(LightPart::Direct)) + size_t(parts.has(LightPart::Indirect));
}

} // namespace strobe::tile_light_format
