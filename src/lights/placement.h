// Common parameters of lights, and the transforms of lights without a shape.
#pragma once

#include "core/interfaces/light.h"
#include "core/params/plugin.h"

namespace strobe {

inline const ParamDef<Rgb> kLightScale{"scale", Rgb(1), "scale of the emission, a color or a number"};
inline const ParamDef<int> kLightSamples{
    "nsamples", 1, "number of samples per shading point", "samples", {1, kMaxLightSamples}};

// pbrt-v4: the total emission, which replaces the magnitude of the intensity or radiance. 0: not replaced.
inline const ParamDef<float> kPower{"power", 0,
                                    "positive total power of a white light, W, which replaces the magnitude "
                                    "of the emission; default: no replacement"};
inline const ParamDef<float> kIlluminance{
    "illuminance", 0,
    "positive irradiance of a facing surface by a white light, W/m², which replaces the magnitude of the "
    "emission; default: no replacement"};
/// Returns the factor of the emission that gives the total `def` (kPower or kIlluminance): its value over
/// `unitTotal`, the total for an emission of 1; 1 if it is not given. Throws a located Error unless it is
/// positive.
float scaleToTotal(const ParamSet& params, const ParamDef<float>& def, float unitTotal);

/// Returns the parameter "scale", which may be a number or a color.
Rgb readLightScale(const ParamSet& params);
/// Returns the emission `def` times "scale". Throws a located Error if it is negative or not finite.
Rgb readEmission(const ParamSet& params, const ParamDef<Rgb>& def, const BuildContext& context);

/// Returns poses of an emitter at equidistant times from `begin` to `end`, for boundPoses. `keys`: number of
/// keys of its motion. Two poses suffice if there are two keys and the middle pose is the mean of both.
template <class PoseAt>
std::vector<EmitterPose> posesOf(int keys, float begin, float end, const PoseAt& poseAt) {
    if (keys <= 1)
        return {poseAt(begin)};
    std::vector<EmitterPose> poses{poseAt(begin), poseAt(end)};
    if (keys == 2) {
        const EmitterPose middle = poseAt((begin + end) / 2);
        const V3f deviation = middle.center - (poses[0].center + poses[1].center) * .5f;
        const bool isTurning = poses[0].axis != poses[1].axis || middle.axis != poses[0].axis;
        if (!isTurning && length(deviation) <= 1e-6f * (length(middle.center) + middle.radius)) {
            for (EmitterPose& pose : poses)
                pose.radius = std::max(pose.radius, middle.radius) + 2 * length(deviation);
            return poses;
        }
    }
    const int count = poseCount(keys);
    poses.clear();
    for (int i = 0; i < count; ++i)
        poses.push_back(poseAt(lerp(begin, end, float(i) / float(count - 1))));
    return poses;
}

/// The light-to-world transform over the shutter. Under the conventions of pbrt-v2 lights do not move: the
/// first key is used.
class LightPlacement {
  public:
    LightPlacement(const LightArgs& args, Conventions conventions);
    bool isStatic() const { return m_toWorld.isStatic(); }
    /// Returns the transform at shutter fraction `time`.
    M44f at(float time) const { return m_toWorld.at(m_shutter.sceneTime(time)); }
    /// Sets the positions and the cone of normals of `bounds` (see boundPoses) for a point of light space
    /// that emits around `axis`. `spread` is that of EmitterBounds.
    void bound(const V3f& point, const V3f& axis, float spread, float begin, float end,
               EmitterBounds& bounds) const;

  private:
    KeyedTransform m_toWorld;
    Shutter m_shutter;
};

} // namespace strobe
