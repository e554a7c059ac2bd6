// Compression by zlib, and checksums.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace strobe {

/// Returns the bytes as a zlib stream, at zlib's fastest level.
std::string compressBytes(std::string_view bytes);
/// Decompresses a zlib stream into `out`. Returns false if it is damaged, or if it does not have out.size()
/// bytes.
bool decompressBytes(std::string_view compressed, std::span<char> out);
/// Returns an upper bound of the size of a zlib stream of this many bytes after decompression.
uint64_t maxDecompressedSize(uint64_t compressedSize);

/// Returns the CRC-32 of the bytes that follow bytes with the CRC-32 `previous`; 0: none.
uint32_t crc32Of(std::string_view bytes, uint32_t previous = 0);

/// Returns the bytes of elements of `size` bytes each, ordered by their index in the element, then by
/// element. Bytes with equal indices are often similar, so that they compress better.
std::string toBytePlanes(std::string_view elements, size_t size);
/// Reverses toBytePlanes.
std::string fromBytePlanes(std::string_view planes, size_t size);

} // namespace strobe
