#include "cameras/placed_camera.h"

namespace strobe {

namespace {

/// Returns true if the transform moves and the shutter interval overlaps its keys.
bool movesDuring(const KeyedTransform& t, const Shutter& shutter) {
    return !t.isStatic() && shutter.close > shutter.open && shutter.open < t.times().back() &&
           shutter.close > t.times().front();
}

} // namespace

CameraPlacement::CameraPlacement(const KeyedTransform& toWorld, const Shutter& shutter)
    : m_toWorld(toWorld), m_shutter(shutter), m_moves(movesDuring(toWorld, shutter)),
      m_midShutter(toWorld.at(shutter.sceneTime(0.5f))) {}

V3f CameraPlacement::toCamera(const V3f& p, float time, float& depth) const {
    const M44f m = at(time).inverse();
    const V3f cameraPoint = transformPoint(m, p);
    depth = cameraPoint.z / length(V3f(m[0][2], m[1][2], m[2][2]));
    return cameraPoint;
}

ScreenWindow readScreenWindow(const ParamSet& params, const V2i& resolution) {
    float aspect = float(resolution.x) / float(resolution.y);
    if (params.has(kFrameAspect))
        aspect = params.get(kFrameAspect);
    const float halfX = std::max(aspect, 1.f), halfY = std::max(1 / aspect, 1.f);
    std::vector<float> window{-halfX, halfX, -halfY, halfY};
    if (params.has(kScreenWindow)) {
        window = params.get(kScreenWindow);
        if (window.size() != 4)
            throw Error(params.whereIs(kScreenWindow), "\"screenwindow\" must be four numbers: x0 x1 y0 y1");
        if (!(window[0] != window[1] && window[2] != window[3]))
            throw Error(params.whereIs(kScreenWindow), "\"screenwindow\" is empty");
    }
    return {{window[0], window[3]},
            {(window[1] - window[0]) / float(resolution.x), (window[2] - window[3]) / float(resolution.y)},
            resolution};
}

Lens readLens(const ParamSet& params) { return {params.get(kLensRadius), params.get(kFocalDistance)}; }

CameraMatrices cameraMatrices(const CameraPlacement& placement, const ScreenWindow& screen,
                              bool isPerspective) {
    const V2f extent(screen.pixel.x * float(screen.resolution.x),
                     screen.pixel.y * float(screen.resolution.y));
    const int shiftRow = isPerspective ? 2 : 3; // the origin is scaled by the depth
    M44f toNdc;
    toNdc[0][0] = 1 / extent.x;
    toNdc[1][1] = 1 / extent.y;
    toNdc[shiftRow][0] = -screen.origin.x / extent.x;
    toNdc[shiftRow][1] = -screen.origin.y / extent.y;
    if (isPerspective) {
        toNdc[2][3] = 1;
        toNdc[3][3] = 0;
    }
    const M44f worldToCamera = placement.midShutter().inverse();
    return {worldToCamera, worldToCamera * toNdc};
}

} // namespace strobe
