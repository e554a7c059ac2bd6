#include "core/camera.h"

namespace strobe {

void Camera::rayLanes(const CameraSampleLanes& samples, int n, CameraRayLanes& out) const {
    CameraSample list[kLanes];
    Ray made[kLanes];
    for (int i = 0; i < n; ++i)
        list[i] = samples.at(i);
    rays(list, n, made);
    for (int i = 0; i < n; ++i)
        out.o.set(i, made[i].o), out.d.set(i, made[i].d);
}

void Camera::coneLanes(const V2Lanes& film, int n, float* width, float* spread) const {
    for (int i = 0; i < n; ++i) {
        const RayCone c = cone(film.at(i));
        width[i] = c.width, spread[i] = c.spread;
    }
}

} // namespace strobe
