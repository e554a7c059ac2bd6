#include "core/interfaces/camera.h"

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

void Camera::viewpointLanes(const V3Lanes& p, const V2Lanes& lens, const float* time, int n,
                            V3Lanes& out) const {
    for (int i = 0; i < n; ++i)
        out.set(i, viewpoint(p.at(i), lens.at(i), time[i]));
}

void Camera::coneLanes(const V2Lanes& film, int n, float* width, float* spread) const {
    for (int i = 0; i < n; ++i) {
        const RayCone c = cone(film.at(i));
        width[i] = c.width, spread[i] = c.spread;
    }
}

} // namespace strobe
