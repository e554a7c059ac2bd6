#include "loader/build/film_plugin.h"

#include <fmt/format.h>

namespace strobe {

namespace {

const ParamDef<int> kXResolution{"xresolution", 640, "width in pixels, 1 to 65536"};
const ParamDef<int> kYResolution{"yresolution", 480, "height in pixels, 1 to 65536"};
const ParamDef<std::vector<float>> kCropWindow{
    "cropwindow", {}, "crop window x0 x1 y0 y1, in fractions of the frame; default: the whole frame"};
const ParamDef<std::vector<int>> kPixelBounds{
    "pixelbounds",
    {},
    "crop window x0 x1 y0 y1, in pixels; x1 and y1 are excluded; default: the whole frame"};
const ParamDef<std::string> kFilename{
    "filename", "",
    "output file; overridden by -o of the command line; default: the name of the scene file with .exr"};

const ParamDef<float> kScale{"scale", 1, "positive factor of all light sources (pbrt-v2 and v3)"};
const ParamDef<float> kIso{"iso", 100,
                           "positive film speed; all light sources are multiplied by iso / 100 (pbrt-v4)"};
const ParamDef<float> kExposureTime{"exposuretime", 1, "positive factor of all light sources (pbrt-v4)"};

/// Larger images exceed the memory of common machines.
constexpr int kMaxResolution = 1 << 16;

FilmSetup makeFilm(const ParamSet& params, const BuildContext&) {
    FilmSetup film;
    film.resolution = {params.get(kXResolution), params.get(kYResolution)};
    for (const auto* def : {&kXResolution, &kYResolution})
        if (const int n = params.get(*def); n < 1 || n > kMaxResolution)
            throw Error(params.whereIs(*def),
                        fmt::format("\"{}\" must be between 1 and {}, not {}", def->name, kMaxResolution, n));
    if (params.has(kCropWindow)) {
        const auto crop = params.get(kCropWindow);
        if (crop.size() != 4 || !(crop[0] < crop[1]) || !(crop[2] < crop[3]))
            throw Error(params.whereIs(kCropWindow),
                        "\"cropwindow\" needs four numbers x0 x1 y0 y1 with x0 < x1 and y0 < y1");
        film.cropX = {crop[0], crop[1]};
        film.cropY = {crop[2], crop[3]};
    }
    if (params.has(kPixelBounds)) {
        const auto bounds = params.get(kPixelBounds);
        if (bounds.size() != 4 || bounds[0] >= bounds[1] || bounds[2] >= bounds[3])
            throw Error(params.whereIs(kPixelBounds),
                        "\"pixelbounds\" needs four integers x0 x1 y0 y1 with x0 < x1 and y0 < y1");
        film.hasPixelBounds = true;
        film.boundsX = {bounds[0], bounds[1]};
        film.boundsY = {bounds[2], bounds[3]};
    }
    film.filename = params.get(kFilename);
    film.scale = params.get(kScale) * params.get(kExposureTime) * params.get(kIso) / 100;
    if (!(film.scale > 0 && film.scale < 1e30f))
        throw Error(params.whereIs(kScale),
                    "\"scale\" times \"exposuretime\" times \"iso\" must be positive and finite");
    return film;
}

} // namespace

Plugin<FilmSetup> imageFilmPlugin() {
    return {"image",
            "an image file",
            {kXResolution, kYResolution, kCropWindow, kPixelBounds, kFilename, kScale, kIso, kExposureTime},
            makeFilm};
}

} // namespace strobe
