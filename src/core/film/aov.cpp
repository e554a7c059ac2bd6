#include "core/film/aov.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace strobe {

namespace {

std::vector<AovInfo> surfaceAovs() {
    using enum Aov;
    using enum AovGroup;
    return {
        {Normal,
         Visible,
         "normal",
         "shading normal on the side of the viewer, world space; mean of the samples",
         {"X", "Y", "Z"}},
        {Albedo,
         Visible,
         "albedo",
         "directional albedo (reflection and transmission); mean of the samples",
         {"R", "G", "B"}},
        {Depth, Visible, "depth", "distance along the axis of the camera; 1e10 without a hit", {"Z"}},
        {Position, Visible, "position", "world space position; 0 without a hit", {"X", "Y", "Z"}},
        {Uv, Visible, "uv", "texture coordinates; 0 without a hit", {"U", "V"}},
        {MotionVector,
         Visible,
         "motionvector",
         "motion in the image from shutter open to shutter close, in pixels to the right and up",
         {"X", "Y"}},
        {ObjectId, Visible, "objectid", "number of the object, from 1; 0 without a hit", {"Y"}},
        {MaterialId, Visible, "materialid", "number of the material, from 1; 0 without a hit", {"Y"}},
        {PrimitiveId, Visible, "primitiveid", "number of the triangle, from 1; 0 without a hit", {"Y"}},
        {CryptoObject, Visible, "cryptoobject", "Cryptomatte of objects", {"CryptoObject"}},
        {CryptoMaterial, Visible, "cryptomaterial", "Cryptomatte of materials", {"CryptoMaterial"}},
        {Alpha,
         Visible,
         "alpha",
         "fraction of the samples that hit a surface: the channel A of the image, also of PNG and TIFF",
         {"A"}},
    };
}

std::vector<AovInfo> lightAndSharingAovs() {
    using enum Aov;
    using enum AovGroup;
    return {
        {Direct,
         Light,
         "direct",
         "emission and direct illumination at the first non-specular vertex, and the background",
         {"R", "G", "B"}},
        {Indirect, Light, "indirect", "all other radiance", {"R", "G", "B"}},
        {LightGroups, Light, "lightgroups", "the light of each group, one layer per group", {"R", "G", "B"}},
        {Shades, Sharing, "shades", "shades that the pixel's samples requested", {"Y"}},
        {Samples, Sharing, "samples", "visibility samples of the pixel", {"Y"}},
        {HitRate, Sharing, "hitrate", "fraction of the samples on surfaces that requested no shade", {"Y"}},
        {Cell,
         Sharing,
         "cell",
         "24-bit id of the shading point or block that the first sample uses; 0: the sample does not share",
         {"Y"},
         "block"},
        {ShadeTime,
         Sharing,
         "shadetime",
         "mean time of the requested shades, as a fraction of the shutter; -1 without any",
         {"Y"}},
        {SharedWeight, Sharing, "sharedweight", "weight of light of other pixels (adaptive-cache)", {"Y"}},
        {SharedWidth, Sharing, "sharedwidth", "mean width of the regions of this light, in pixels", {"Y"}},
        {SharedError, Sharing, "sharederror", "estimated standard error, mean of the channels", {"Y"}},
        {Variance,
         Sharing,
         "variance",
         "variance of the luminance of the pixel, estimated from the passes of --noise-target",
         {"Y"}},
    };
}

} // namespace

const std::vector<AovInfo>& aovTable() {
    static const std::vector<AovInfo> table = [] {
        std::vector<AovInfo> all = surfaceAovs();
        const std::vector<AovInfo> others = lightAndSharingAovs();
        all.insert(all.end(), others.begin(), others.end());
        return all;
    }();
    return table;
}

const AovInfo& aovInfo(Aov aov) { return aovTable()[size_t(aov)]; }

const AovInfo* findAov(const std::string& name) {
    for (const AovInfo& row : aovTable())
        if (name == row.name || (row.deprecatedName && name == row.deprecatedName))
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

namespace {

/// Returns the names of an AOV's channels in EXR files, separated by blanks.
std::string channelNames(const AovInfo& row) {
    if (row.aov == Aov::CryptoObject || row.aov == Aov::CryptoMaterial)
        return fmt::format("{0}00.R {0}00.G {0}00.B {0}00.A {0}01.R ...", row.channels[0]);
    if (row.aov == Aov::Alpha)
        return row.channels[0];
    const char* layer = row.aov == Aov::LightGroups ? "light_GROUP" : row.name;
    std::string names;
    for (const char* channel : row.channels)
        names += fmt::format("{}{}.{}", names.empty() ? "" : " ", layer, channel);
    return names;
}

} // namespace

std::string listAovs() {
    std::string out = "AOV: the layers of EXR files (--aov)\n";
    for (const AovInfo& row : aovTable())
        out +=
            fmt::format("  {:<18}  {}\n      {:<16}  {}\n", row.name, row.doc, "channels", channelNames(row));
    return out + '\n';
}

std::vector<Aov> aovsInGroup(const std::vector<Aov>& aovs, AovGroup group) {
    std::vector<Aov> found;
    std::copy_if(aovs.begin(), aovs.end(), std::back_inserter(found),
                 [&](Aov aov) { return aovInfo(aov).group == group; });
    return found;
}

} // namespace strobe
