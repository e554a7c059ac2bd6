#include "core/interfaces/camera.h"

namespace strobe {

void Camera::raySoA(const CameraSampleSoA& samples, int n, CameraRaySoA& out) const {
    CameraSample sampleList[kSoAWidth];
    Ray rayList[kSoAWidth];
    for (int i = 0; i < n; ++i)
        sampleList[i] = samples.at(i);
    rays(sampleList, n, rayList);
    for (int i = 0; i < n; ++i) {
        out.o.set(i, rayList[i].o);
        out.d.set(i, rayList[i].d);
    }
}

void Camera::viewpointSoA(const V3SoA& p, const V2SoA& lens, const float* time, int n, V3SoA& out) const {
    for (int i = 0; i < n; ++i)
        out.set(i, viewpoint(p.at(i), lens.at(i), time[i]));
}

void Camera::coneSoA(const V2SoA& film, int n, float* width, float* spread) const {
    for (int i = 0; i < n; ++i) {
        const RayCone c = cone(film.at(i));
        width[i] = c.width;
        spread[i] = c.spread;
    }
}

} // namespace strobe
