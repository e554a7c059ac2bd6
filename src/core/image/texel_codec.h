// The stored form of texels: codes of 8 or 16 bits, or floats.
#pragma once

#include "core/image/image.h"

#include <cstddef>

namespace strobe {

/// Conversion between linear values and the codes that texels are stored as. Bytes keep the encoding of their
/// file, so that an 8-bit image takes 8 bits per value.
class TexelCodec {
  public:
    enum Kind { Byte, Word, Half, Float };

    /// Returns the codec that keeps the values of a file: `stored` is the type of the file, and `encoding` is
    /// that of its values. Encodings that bytes cannot keep use half floats.
    static TexelCodec of(StoredType stored, const ColorEncoding& encoding);

    Kind kind() const { return m_kind; }
    size_t bytes() const { return m_kind == Byte ? 1 : m_kind == Float ? 4 : 2; }
    /// Whether the codes are the values of a file of type `stored`.
    bool keeps(StoredType stored) const;
    /// The linear values by code; empty for Float.
    const std::vector<float>& values() const { return m_values; }

    /// Returns the linear value of code number i.
    float decode(const std::byte* codes, size_t i) const;
    /// Adds the linear values of `count` codes, from number `first`, times `weight` to `sums`.
    void addDecoded(const std::byte* codes, size_t first, size_t count, float weight, float* sums) const;
    /// Stores the code that is nearest to a linear value as number i.
    void encode(float value, std::byte* codes, size_t i) const;

  private:
    TexelCodec(Kind kind, const ColorEncoding& encoding);

    Kind m_kind;
    std::vector<float> m_values;
    std::vector<uint8_t> m_nearest; ///< Byte: the nearest code, by the value scaled to 16 bits
};

} // namespace strobe
