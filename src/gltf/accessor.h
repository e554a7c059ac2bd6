// Accessors: typed arrays in the buffers of a glTF file, checked before a byte of them is read.
#pragma once

#include "core/math/math.h"
#include "gltf/document.h"

#include <optional>
#include <span>

namespace strobe::gltf {

/// The bytes of a buffer view. An Error at `place` when it does not lie in its buffer.
std::span<const unsigned char> viewBytes(const Document& document, int bufferView, const std::string& place);

/// How many elements an accessor has.
size_t accessorCount(const Document& document, int accessor, const std::string& place);

/// Components per element: 1 for SCALAR … 16 for MAT4.
int accessorComponents(const Document& document, int accessor, const std::string& place);

/// The accessor's numbers in order, sparse ones replaced, normalized integers as fractions. `components`: how
/// many each element must have. `count`: how many elements there must be, when that is known. Throws an Error
/// at `place` for anything that does not fit, and for numbers that are not finite.
std::vector<float> readFloats(const Document& document, int accessor, int components,
                              const std::string& place, std::optional<size_t> count = {});

/// The same of unsigned integers of 8, 16 or 32 bits, neither normalized nor floats.
std::vector<uint32_t> readIntegers(const Document& document, int accessor, int components,
                                   const std::string& place, std::optional<size_t> count = {});

/// readFloats of three components as vectors, of two as points, of sixteen as matrices (glTF's columns are
/// our rows, since it multiplies from the left).
std::vector<V3f> readV3f(const Document& document, int accessor, const std::string& place,
                         std::optional<size_t> count = {});
std::vector<V2f> readV2f(const Document& document, int accessor, const std::string& place,
                         std::optional<size_t> count = {});
std::vector<M44f> readM44f(const Document& document, int accessor, const std::string& place,
                           std::optional<size_t> count = {});

} // namespace strobe::gltf
