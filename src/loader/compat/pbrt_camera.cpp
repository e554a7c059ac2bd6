#include "loader/compat/pbrt_compat.h"

#include <cctype>
#include <numbers>

namespace strobe {
namespace {

const ParamDef<std::string> kLensFile{"lensfile", "", "file that describes the lens"};
const ParamDef<float> kAperture{"aperturediameter", 1, "diameter of the aperture in mm"};
const ParamDef<float> kFocusDistance{"focusdistance", 10, "focus distance in scene units, taken as meters",
                                     "focaldistance"};
const ParamDef<float> kDiagonal{"diagonal", 35, "diagonal of the film in mm"};

/// Returns the focal length in mm: the number before "mm" in the name of a lens file, as in the names of
/// pbrt's lenses, or 50 if there is none.
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
    const float x = float(resolution.x);
    const float y = float(resolution.y);
    const float shorter = filmDiagonal * std::min(x, y) / std::hypot(x, y);
    std::vector<Param> replacements{
        number("fov", 2 * std::atan(shorter / (2 * mm)) * (180 / std::numbers::pi_v<float>)),
        number("lensradius", camera.get(kAperture) / 2000),
        number("focaldistance", camera.get(kFocusDistance))};
    camera.markAllUsed();
    for (Param& p : replacements) {
        std::erase_if(camera.all(), [&](const Param& old) { return old.name == p.name; });
        camera.add(std::move(p));
    }
}

} // namespace strobe
