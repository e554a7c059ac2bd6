// Common functions of cameras: the transform over the shutter, pbrt's screen window, and the thin lens.
#pragma once

#include "core/interfaces/camera.h"
#include "core/math/sampling.h"
#include "core/params/params.h"

namespace strobe {

/// The transform of a camera over the shutter; evaluated once if the camera does not move.
class CameraPlacement {
  public:
    CameraPlacement(const KeyedTransform& toWorld, const Shutter& shutter);
    bool moves() const { return m_moves; }
    /// Returns the camera-to-world transform at shutter fraction `time`.
    M44f at(float time) const { return m_moves ? m_toWorld.at(m_shutter.sceneTime(time)) : m_midShutter; }
    /// Returns the camera-to-world transform at mid-shutter.
    const M44f& midShutter() const { return m_midShutter; }
    /// Transforms a world-space point to camera space at shutter fraction `time`. `depth` is set to its
    /// distance from the plane z = 0 of camera space, in units of the scene.
    V3f toCamera(const V3f& p, float time, float& depth) const;

  private:
    KeyedTransform m_toWorld;
    Shutter m_shutter;
    bool m_moves;
    M44f m_midShutter;
};

/// The map from film points (pixels, row 0 at the top) to the screen plane (x right, y up).
struct ScreenWindow {
    V2f origin;           ///< screen position of film point (0,0)
    V2f pixel;            ///< screen extent of one pixel; y is negative
    V2i resolution{1, 1}; ///< of the frame
    V2f toScreen(const V2f& film) const { return {origin.x + film.x * pixel.x, origin.y + film.y * pixel.y}; }
    V2f toFilm(const V2f& screen) const {
        return {(screen.x - origin.x) / pixel.x, (screen.y - origin.y) / pixel.y};
    }
};

inline const ParamDef<std::vector<float>> kScreenWindow{
    "screenwindow",
    {},
    "bounds x0 x1 y0 y1 of the image on the screen plane; default: ±1 along the shorter axis"};
inline const ParamDef<float> kFrameAspect{"frameaspectratio", 0,
                                          "width / height of the screen window; default: that of the film",
                                          nullptr, kPositive};
inline const ParamDef<float> kLensRadius{
    "lensradius", 0, "radius of the thin lens in units of camera space; 0: pinhole", nullptr, kNotNegative};
inline const ParamDef<float> kFocalDistance{
    "focaldistance", 1e6f, "distance of the plane of focus along the camera axis", nullptr, kPositive};

/// Returns the matrices of a camera. `isPerspective`: points are divided by their depth before the screen.
CameraMatrices cameraMatrices(const CameraPlacement& placement, const ScreenWindow& screen,
                              bool isPerspective);

/// Returns the screen window given by "screenwindow" or "frameaspectratio". Throws a located Error if it is
/// empty.
ScreenWindow readScreenWindow(const ParamSet& params, const V2i& resolution);

/// A thin lens in camera space.
struct Lens {
    float radius = 0;
    float focalDistance = 1e6f;

    /// Returns a point of the lens, uniform by area; u in [0,1)².
    V3f samplePoint(const V2f& u) const {
        if (!(radius > 0))
            return V3f(0);
        const V2f p = concentricDisk(u) * radius;
        return {p.x, p.y, 0};
    }
};
/// Returns the lens given by "lensradius" and "focaldistance". Throws a located Error for values out of
/// range.
Lens readLens(const ParamSet& params);

} // namespace strobe
