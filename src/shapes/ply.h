// A reader of PLY files: ASCII, binary little endian and binary big endian, format version 1.0.
#pragma once

#include "core/math/math.h"
#include "core/util/error.h"

#include <string_view>
#include <vector>

namespace strobe {

/// What a renderer wants of a PLY file.
struct PlyMesh {
    /// Positions have room for so many more: Embree reads a little beyond the last.
    static constexpr size_t kSpare = 2;
    std::vector<V3f> positions;
    std::vector<V3f> normals; ///< empty, or one per position
    std::vector<V2f> uvs;     ///< empty, or one per position
    std::vector<uint32_t>
        indices;              ///< three per triangle, all in range; faces of more corners are split as fans
    size_t trailingBytes = 0; ///< after the last element, from the first that is no white space
};

/// Reads the contents of a PLY file. Vertices: x y z, [nx ny nz], [u v | s t | texture_u texture_v |
/// texture_s texture_t]; faces: a list called vertex_indices or vertex_index. Other properties and elements
/// are skipped. Values may be NaN. Anything malformed is an Error at `where` that names `fileName`; no
/// allocation is larger than the contents warrant, whatever the header claims.
PlyMesh parsePly(std::string_view contents, const std::string& fileName, const Location& where,
                 bool mayBeEmpty = false);

/// As parsePly, from a file, which may be packed by gzip. `mayBeEmpty`: a file without vertices or faces is a
/// mesh without them.
PlyMesh readPlyFile(const std::filesystem::path& path, const Location& where, bool mayBeEmpty = false);

} // namespace strobe
