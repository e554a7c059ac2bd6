#include "core/util/compression.h"

#include <zlib.h>

#include <new>

namespace strobe {

namespace {

/// Transposes a matrix of bytes.
std::string transposed(std::string_view bytes, size_t rows, size_t columns) {
    std::string out(bytes.size(), '\0');
    for (size_t column = 0; column < columns; ++column)
        for (size_t row = 0; row < rows; ++row)
            out[column * rows + row] = bytes[row * columns + column];
    return out;
}

} // namespace

std::string compressBytes(std::string_view bytes) {
    uLongf size = compressBound(uLong(bytes.size()));
    std::string out(size, '\0');
    // It fails for lack of memory only: the buffer has the size of the worst case.
    if (compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                  uLong(bytes.size()), Z_BEST_SPEED) != Z_OK)
        throw std::bad_alloc();
    out.resize(size);
    return out;
}

bool decompressBytes(std::string_view compressed, std::span<char> out) {
    uLongf size = uLongf(out.size());
    uLong read = uLong(compressed.size());
    char none = 0; // zlib needs an address
    return uncompress2(reinterpret_cast<Bytef*>(out.empty() ? &none : out.data()), &size,
                       reinterpret_cast<const Bytef*>(compressed.data()), &read) == Z_OK &&
           size == out.size() && read == compressed.size();
}

uint64_t maxDecompressedSize(uint64_t compressedSize) {
    constexpr uint64_t kMaxRatio = 1032; // a length of 258 bytes in two bits
    return compressedSize > UINT64_MAX / kMaxRatio ? UINT64_MAX : compressedSize * kMaxRatio;
}

uint32_t crc32Of(std::string_view bytes, uint32_t previous) {
    return uint32_t(crc32_z(previous, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string toBytePlanes(std::string_view elements, size_t size) {
    return transposed(elements, elements.size() / size, size);
}

std::string fromBytePlanes(std::string_view planes, size_t size) {
    return transposed(planes, size, planes.size() / size);
}

} // namespace strobe
