// A reader of PLY files: ASCII, binary little-endian and binary big-endian, format version 1.0.
#pragma once

#include "core/math/math.h"
#include "core/util/error.h"

#include <string_view>
#include <vector>

namespace strobe {

/// The triangle mesh of a PLY file.
struct PlyMesh {
    /// Spare capacity of `positions`, because Embree reads beyond the last one.
    static constexpr size_t kSpareCapacity = 2;
    std::vector<V3f> positions;
    std::vector<V3f> normals; ///< empty, or one per position
    std::vector<V2f> uvs;     ///< empty, or one per position
    /// Three per triangle, all in range. Faces with more vertices are split into fans.
    std::vector<uint32_t> indices;
    size_t trailingBytes = 0; ///< bytes after the last element, without leading white space
};

/// Parses the contents of a PLY file. Vertex properties: x y z, optionally nx ny nz, and one pair of u v, s
/// t, texture_u texture_v or texture_s texture_t. Face property: a list vertex_indices or vertex_index. Other
/// properties and elements are skipped. Values may be NaN. `mayBeEmpty`: returns an empty mesh if there are
/// no vertices or faces, which is an Error otherwise. Throws an Error at `where` that names `fileName` if the
/// file is malformed. Allocations are limited by the size of the contents, not by counts in the header.
PlyMesh parsePly(std::string_view contents, const std::string& fileName, const Location& where,
                 bool mayBeEmpty = false);

/// Reads a PLY file, which may be compressed by gzip; see parsePly.
PlyMesh readPlyFile(const std::filesystem::path& path, const Location& where, bool mayBeEmpty = false);

} // namespace strobe
