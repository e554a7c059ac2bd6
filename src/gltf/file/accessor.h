// Accessors: typed arrays in the buffers of a glTF file. All bounds are checked before data is read.
#pragma once

#include "core/math/math.h"
#include "core/util/diagnostics.h"
#include "gltf/file/document.h"

#include <optional>
#include <span>

namespace strobe::gltf {

// `jsonPath` is the JSON path of the reference, which errors name: "meshes[0].primitives[0].indices".

/// Returns the bytes of a buffer view. Throws an Error if it exceeds its buffer.
std::span<const unsigned char> viewBytes(const Document& document, int bufferView,
                                         const std::string& jsonPath);

/// Returns the number of elements of an accessor.
size_t accessorCount(const Document& document, int accessor, const std::string& jsonPath);

/// Returns the number of components per element: 1 for SCALAR to 16 for MAT4.
int accessorComponents(const Document& document, int accessor, const std::string& jsonPath);

/// Returns all components of an accessor in order, with sparse substitutions; normalized integers as
/// fractions. Throws an Error if elements do not have `components` components, if there are not `count`
/// elements (none: any number), if the data exceeds its buffer view, or if a number is not finite.
std::vector<float> readFloats(const Document& document, int accessor, int components,
                              const std::string& jsonPath, std::optional<size_t> count = {});

/// Returns the numbers of an accessor as they are stored, with sparse substitutions. They need not be finite.
/// Throws an Error if the data exceeds its buffer view.
std::vector<float> readStored(const Document& document, int accessor, const std::string& jsonPath);

/// As readFloats, of unsigned integers of 8, 16 or 32 bits that are not normalized.
std::vector<uint32_t> readIntegers(const Document& document, int accessor, int components,
                                   const std::string& jsonPath, std::optional<size_t> count = {});

/// As readFloats, of vectors, points and matrices. The columns of glTF's matrices become rows: glTF
/// multiplies column vectors from the left, strobe row vectors from the right.
std::vector<V3f> readV3f(const Document& document, int accessor, const std::string& jsonPath,
                         std::optional<size_t> count = {});
/// As readV3f, of directions. Those that are not finite become (0,1,0), with a warning, or throw if
/// `diagnostics` is strict.
std::vector<V3f> readDirections(const Document& document, int accessor, const std::string& jsonPath,
                                std::optional<size_t> count, Diagnostics& diagnostics);
std::vector<V2f> readV2f(const Document& document, int accessor, const std::string& jsonPath,
                         std::optional<size_t> count = {});
std::vector<M44f> readM44f(const Document& document, int accessor, const std::string& jsonPath,
                           std::optional<size_t> count = {});

} // namespace strobe::gltf
