// What the mesh shapes share: their parameters, keys of deforming meshes, and the checks that every mesh
// passes.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"

namespace strobe {

/// Parameters that more than one mesh shape takes.
namespace mesh_params {
inline const ParamDef<std::vector<int>> kIndices{"indices", {}, "three vertex numbers per triangle, from 0"};
inline const ParamDef<std::vector<V3f>> kP{
    "P", {}, "vertex positions; of a deforming mesh, those of each key in turn"};
inline const ParamDef<std::vector<V3f>> kN{"N", {}, "vertex normals; as many as P, or one set for all keys"};
inline const ParamDef<int> kKeys{"keys", 1, "number of keys of a deforming mesh; 1: still"};
inline const ParamDef<std::vector<float>> kKeyTimes{
    "keytimes", {}, "scene time of each key, ascending; default: TransformTimes, evenly divided"};
inline const ParamDef<FloatInput> kAlpha{"alpha", FloatInput(1),
                                         "opacity: below 1 partly, at 0 wholly cut away"};
inline const ParamDef<FloatInput> kShadowAlpha{"shadowalpha", FloatInput(1),
                                               "ignored with a warning: shadows use alpha"};
} // namespace mesh_params

/// Per-vertex values of a mesh: one array per key.
using KeyedPoints = std::vector<std::vector<V3f>>;

/// "indices": numbers of triples, each in [0, vertexCount). Missing with exactly three vertices: one
/// triangle.
std::vector<uint32_t> readIndices(const ParamSet& params, size_t vertexCount);

/// "P", split into "keys" equal parts, all finite.
KeyedPoints readPositions(const ParamSet& params);

/// "N", one array per key of `positions`; a single set is used for every key; empty when not given.
KeyedPoints readNormals(const ParamSet& params, const KeyedPoints& positions, const BuildContext& context);

/// Normals that are NaN or infinite: an Error, or, in a lenient file, a warning, and they become zero, which
/// stands for the geometry's own.
void checkNormals(std::vector<V3f>& normals, const std::string& ofKey, const Location& where,
                  const BuildContext& context);

/// Warns that a mesh of no triangles is left out, which only a lenient file may have.
void warnOfEmptyMesh(const Location& where, const BuildContext& context);

/// The scene time of each of `keyCount` keys, strictly ascending; empty when there is only one.
std::vector<float> readKeyTimes(const ParamSet& params, size_t keyCount, const BuildContext& context);

/// "alpha"; warns when "shadowalpha" is given too.
FloatInput readAlpha(const ParamSet& params, const BuildContext& context);

/// Throws when a coordinate is NaN or infinite; the message names the vertex and, of several, the key.
/// `what` is the noun of the message, e.g. "position".
void requireFinite(const KeyedPoints& values, const char* what, const Location& where);
/// The same of one key; `ofKey` is put behind the vertex.
void requireFinite(const std::vector<V3f>& values, const char* what, const std::string& ofKey,
                   const Location& where);

} // namespace strobe
