// What the cameras share: their place in the world over the shutter, and pbrt's screen window.
#pragma once

#include "core/interfaces/camera.h"
#include "core/math/sampling.h"
#include "core/params/params.h"

namespace strobe {

/// A camera's transform over the shutter; one that does not move is evaluated once.
class CameraPlacement {
  public:
    CameraPlacement(const KeyedTransform& toWorld, const Shutter& shutter);
    bool moves() const { return m_moves; }
    /// Camera to world at shutter fraction `time`.
    M44f at(float time) const { return m_moves ? m_toWorld.at(m_shutter.sceneTime(time)) : m_still; }
    /// The transform of a camera that does not move, or that at mid-shutter.
    const M44f& middle() const { return m_still; }
    /// A world point in camera space at shutter fraction `time`; `depth` is its distance from the plane z = 0
    /// of camera space, in scene units.
    V3f toCamera(const V3f& p, float time, float& depth) const;

  private:
    KeyedTransform m_toWorld;
    Shutter m_shutter;
    bool m_moves;
    M44f m_still;
};

/// Film points to the screen plane: x right, y up, film row 0 at the top.
struct ScreenWindow {
    V2f origin; ///< of film point (0,0)
    V2f pixel;  ///< screen extent of one pixel; y is negative
    V2f at(const V2f& film) const { return {origin.x + film.x * pixel.x, origin.y + film.y * pixel.y}; }
    /// The film point that is at a point of the screen plane.
    V2f filmAt(const V2f& screen) const {
        return {(screen.x - origin.x) / pixel.x, (screen.y - origin.y) / pixel.y};
    }
};

inline const ParamDef<std::vector<float>> kScreenWindow{
    "screenwindow", {}, "x0 x1 y0 y1 on the screen plane; default: ±1 along the shorter axis"};
inline const ParamDef<float> kFrameAspect{
    "frameaspectratio", 0, "width / height of the screen window; default: of the film", nullptr, kPositive};
inline const ParamDef<float> kLensRadius{"lensradius", 0, "radius of the thin lens; 0: a pinhole", nullptr,
                                         kNotNegative};
inline const ParamDef<float> kFocalDistance{
    "focaldistance", 1e6f, "distance of the plane in focus, along the camera's axis", nullptr, kPositive};

/// Reads "screenwindow" and "frameaspectratio". Throws a located Error.
ScreenWindow readScreenWindow(const ParamSet& params, const V2i& resolution);

/// A thin lens, in camera space.
struct Lens {
    float radius = 0;
    float focalDistance = 1e6f;

    /// The point of the lens for u in [0,1)², in camera space.
    V3f at(const V2f& u) const {
        if (!(radius > 0))
            return V3f(0);
        const V2f p = concentricDisk(u) * radius;
        return {p.x, p.y, 0};
    }
};
/// Reads "lensradius" and "focaldistance". Throws a located Error.
Lens readLens(const ParamSet& params);

} // namespace strobe
