// Parameters and checks that mesh shapes share, and the keys of deforming meshes.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// Parameters of more than one mesh shape.
namespace mesh_params {
inline const ParamDef<std::vector<int>> kIndices{
    "indices", {}, "three vertex indices per triangle, from 0; may be missing for a single triangle"};
inline const ParamDef<std::vector<V3f>> kP{
    "P",
    {},
    "vertex positions; of a deforming mesh, all positions of the first key, then of the second, ..."};
inline const ParamDef<std::vector<V3f>> kN{"N", {}, "vertex normals; as many as P, or one set for all keys"};
inline const ParamDef<int> kKeys{"keys", 1, "number of keys of a deforming mesh, at least 1; 1: static"};
inline const ParamDef<std::vector<float>> kKeyTimes{
    "keytimes", {}, "scene time of each key, ascending; default: equidistant over TransformTimes"};
inline const ParamDef<FloatInput> kAlpha{
    "alpha", FloatInput(1), "opacity, 0 (cut away) to 1; in between, hits are accepted at random"};
inline const ParamDef<FloatInput> kShadowAlpha{"shadowalpha", FloatInput(1),
                                               "ignored with a warning: shadow rays use \"alpha\""};
} // namespace mesh_params

/// Per-vertex vectors of a mesh, one array per key.
using KeyedPoints = std::vector<std::vector<V3f>>;

/// Returns "indices": three per triangle, each in [0, vertexCount). If the parameter is missing, exactly
/// three vertices are one triangle. Throws a located Error if indices are missing or out of range.
std::vector<uint32_t> readIndices(const ParamSet& params, size_t vertexCount);

/// Returns "P", split into one array per key. Throws a located Error if the arrays are not of equal size or
/// values are not finite.
KeyedPoints readPositions(const ParamSet& params);

/// Returns "N", split into one array per key of `positions`; a single array is used for all keys; empty if
/// not given. Throws a located Error if the number of normals does not match; see checkNormals for their
/// values.
KeyedPoints readNormals(const ParamSet& params, const KeyedPoints& positions, const BuildContext& context);

/// Checks that normals are finite. Otherwise throws a located Error; in a lenient file, warns and sets the
/// normals to zero, which selects the geometric normal. `ofKey`: a suffix of the message that names the key.
void checkNormals(std::vector<V3f>& normals, const std::string& ofKey, const Location& where,
                  const BuildContext& context);

/// Warns that a mesh without triangles, which is allowed in lenient files, is ignored.
void warnOfEmptyMesh(const Location& where, const BuildContext& context);

/// Returns the scene time of each of `keyCount` keys, strictly ascending; empty for one key. Default:
/// equidistant over the TransformTimes of the scene.
std::vector<float> readKeyTimes(const ParamSet& params, size_t keyCount, const BuildContext& context);

/// Returns "alpha". Warns if "shadowalpha" is given.
FloatInput readAlpha(const ParamSet& params, const BuildContext& context);

/// Throws an Error at `where` if a coordinate is not finite. The message names the vertex and, if there are
/// several, the key. `noun` is the noun of the message, for example "position".
void requireFinite(const KeyedPoints& values, const char* noun, const Location& where);
/// Checks one key. `ofKey`: a suffix of the message that names the key.
void requireFinite(const std::vector<V3f>& values, const char* noun, const std::string& ofKey,
                   const Location& where);

} // namespace strobe
