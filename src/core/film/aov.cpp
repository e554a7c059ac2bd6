#include "core/film/aov.h"

#include <algorithm>
#include <iterator>

namespace strobe {

const std::vector<AovInfo>& aovTable() {
    using enum Aov;
    using enum AovGroup;
    static const std::vector<AovInfo> table = {
        {Normal,
         Visible,
         "normal",
         "shading normal on the viewer's side, world space; mean",
         {"X", "Y", "Z"}},
        {Albedo, Visible, "albedo", "reflectance under uniform white light; mean", {"R", "G", "B"}},
        {Depth, Visible, "depth", "distance along the camera's axis; 1e10 where nothing was hit", {"Z"}},
        {Position, Visible, "position", "world space", {"X", "Y", "Z"}},
        {Uv, Visible, "uv", "texture coordinates", {"U", "V"}},
        {MotionVector,
         Visible,
         "motionvector",
         "pixels to the right and up, from shutter open to close",
         {"X", "Y"}},
        {ObjectId, Visible, "objectid", "number of the object, from 1; 0 where nothing was hit", {"Y"}},
        {MaterialId, Visible, "materialid", "number of the material, from 1; 0 where nothing was hit", {"Y"}},
        {PrimitiveId,
         Visible,
         "primitiveid",
         "number of the triangle in its shape, from 1; 0 where nothing was hit",
         {"Y"}},
        {CryptoObject, Visible, "cryptoobject", "Cryptomatte of objects", {"CryptoObject"}},
        {CryptoMaterial, Visible, "cryptomaterial", "Cryptomatte of materials", {"CryptoMaterial"}},
        {Direct,
         Light,
         "direct",
         "emission and direct illumination at the first non-specular vertex",
         {"R", "G", "B"}},
        {Indirect, Light, "indirect", "all other radiance", {"R", "G", "B"}},
        {LightGroups, Light, "lightgroups", "one layer per group of lights", {"R", "G", "B"}},
        {Shades, Sharing, "shades", "shades that the pixel's samples requested", {"Y"}},
        {Samples, Sharing, "samples", "visibility samples", {"Y"}},
        {HitRate, Sharing, "hitrate", "fraction of the samples on surfaces that requested no shade", {"Y"}},
        {Cell,
         Sharing,
         "cell",
         "24-bit id of the cell whose shade the first sample uses; 0: it shares none",
         {"Y"},
         "block"},
        {ShadeTime,
         Sharing,
         "shadetime",
         "mean shutter fraction of the requested shades; -1 without any",
         {"Y"}},
        {Variance,
         Sharing,
         "variance",
         "of the pixel's luminance, estimated from the passes of --noise-target",
         {"Y"}},
    };
    return table;
}

const AovInfo& aovInfo(Aov aov) { return aovTable()[size_t(aov)]; }

const AovInfo* findAov(const std::string& name) {
    for (const AovInfo& row : aovTable())
        if (name == row.name || (row.formerName && name == row.formerName))
            return &row;
    return nullptr;
}

std::string aovNames(AovGroup group) {
    std::string names;
    for (const AovInfo& row : aovTable())
        if (row.group == group)
            names += (names.empty() ? "" : ", ") + std::string(row.name);
    return names;
}

std::vector<Aov> aovsOf(const std::vector<Aov>& aovs, AovGroup group) {
    std::vector<Aov> found;
    std::copy_if(aovs.begin(), aovs.end(), std::back_inserter(found),
                 [&](Aov aov) { return aovInfo(aov).group == group; });
    return found;
}

} // namespace strobe
