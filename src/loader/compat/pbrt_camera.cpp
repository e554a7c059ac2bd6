#include "loader/compat/pbrt_compat.h"

#include <cctype>
#include <numbers>

namespace strobe {
namespace {

const ParamDef<std::string> kLensFile{"lensfile", "", "description of the lens"};
const ParamDef<float> kAperture{"aperturediameter", 1, "in mm"};
const ParamDef<float> kFocusDistance{"focusdistance", 10, "in scene units, which are meters",
                                     "focaldistance"};
const ParamDef<float> kDiagonal{"diagonal", 35, "of the film, in mm"};

/// The number before "mm" in a lens file's name, as pbrt's own lenses have it; 50 where there is none.
float focalLength(const std::string& name) {
    const size_t mm = name.rfind("mm");
    size_t begin = mm;
    while (begin != std::string::npos && begin > 0 &&
           std::isdigit(static_cast<unsigned char>(name[begin - 1])))
        --begin;
    const float length = begin < mm && mm != std::string::npos ? std::strtof(&name[begin], nullptr) : 0;
    return length > 0 ? length : 50;
}

Param number(const char* name, float value) {
    return {name, ParamType::Float, {}, {value}, {}, {}, false, false};
}

} // namespace

float readDiagonal(const ParamSet& film) { return film.get(kDiagonal); }

void makePerspective(ParamSet& camera, float filmDiagonal, const V2i& resolution) {
    const float mm = focalLength(camera.get(kLensFile));
    const float x = float(resolution.x), y = float(resolution.y);
    const float shorter = filmDiagonal * std::min(x, y) / std::hypot(x, y);
    std::vector<Param> ours{
        number("fov", 2 * std::atan(shorter / (2 * mm)) * (180 / std::numbers::pi_v<float>)),
        number("lensradius", camera.get(kAperture) / 2000),
        number("focaldistance", camera.get(kFocusDistance))};
    camera.markAllUsed();
    for (Param& p : ours) {
        std::erase_if(camera.all(), [&](const Param& old) { return old.name == p.name; });
        camera.add(std::move(p));
    }
}

} // namespace strobe
