#include "cli/image_options.h"

#include "cli/option_validators.h"

#include <cstdlib>

namespace strobe {
namespace {

ExrSettings exrSettingsOf(const std::string& words) {
    try {
        return parseExrSettings(words);
    } catch (const Error& e) {
        throw CLI::ValidationError("--exr", e.what());
    }
}

} // namespace

void addImageOptions(CLI::App& app, ImageOptions& options) {
    if (const char* file = std::getenv("OCIO"))
        options.color = std::make_shared<const ColorConfig>(file);
    app.add_option_function<std::string>(
        "--exr", [&options](const std::string& words) { options.exr = exrSettingsOf(words); },
        "storage of EXRs, words separated by commas: float or half; none, rle, zips, zip, piz, pxr24, b44, "
        "b44a, dwaa or dwab; scanlines or tiles:EDGE; single or parts");
    app.add_option("--view", options.view.view,
                   "view of PNGs, of the OpenColorIO config ($OCIO, or the built-in one)");
    app.add_option("--display", options.view.display, "display of PNGs, of the OpenColorIO config");
    app.add_option("--look", options.view.look, "look of PNGs, in place of the looks of the view");
    app.add_option("--exposure", options.exposure, "exposure of PNGs, in stops")
        ->transform(finiteNumber<float>());
}

} // namespace strobe
