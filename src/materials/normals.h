// Shading normals from textures: normal maps, bump maps, and materials that use them.
#pragma once

#include "core/interfaces/material.h"

namespace strobe {

/// Computes shading normals from textures. Immutable; all functions are thread-safe.
class Normals {
  public:
    virtual ~Normals() = default;
    /// Returns the shading normal in world space, of any length.
    virtual V3f normal(const TextureQuery& q, const TangentFrame& frame) const = 0;
    virtual bool needsFootprint() const = 0;
};
using NormalsPtr = std::shared_ptr<const Normals>;

/// Normals from a texture of tangent-space normals: (0.5, 0.5, 1) encodes the interpolated normal, red tilts
/// it along dp/du, green along dp/dv. `scale`: of the tilt.
NormalsPtr makeNormalMap(std::shared_ptr<const Texture> map, float scale);

/// The lengths of dp/du and dp/dv to which a bump map refers where a mesh has vertex normals.
enum class BumpTangents {
    Exact,     ///< of the surface, as without vertex normals: the displacement is in units of world space
    Unit,      ///< 1, as in pbrt-v2 and v3
    EqualToDu, ///< both of dp/du, as in pbrt-v4
};

/// Normals of the surface displaced along its normal, by Blinn ("Simulation of Wrinkled Surfaces", 1978).
/// The differences are taken over half of the footprint, as in pbrt; the curvature of the surface below is
/// neglected.
NormalsPtr makeBumpMap(FloatInput displacement, BumpTangents tangents);

/// Returns `material` with other shading normals.
std::shared_ptr<const Material> withNormals(std::shared_ptr<const Material> material, NormalsPtr normals);

} // namespace strobe
