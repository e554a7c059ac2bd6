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

} // namespace strobe
