#include "cli/options/image_options.h"

#include "cli/options/option_validators.h"

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

void nameStandardOutput(std::vector<std::filesystem::path>& images) {
    std::replace(images.begin(), images.end(), std::filesystem::path("-"), std::filesystem::path("-.exr"));
}

void addImageOptions(CLI::App& app, ImageOptions& options) {
    if (const char* file = std::getenv("OCIO"))
        options.color = std::make_shared<const ColorConfig>(file, "$OCIO");
    app.add_option_function<std::string>(
           "--exr", [&options](const std::string& words) { options.exr = exrSettingsOf(words); },
           "storage of EXRs, words separated by commas: float or half; none, rle, zips, zip, piz, pxr24, "
           "b44, "
           "b44a, dwaa:LEVEL or dwab:LEVEL; scanlines or tiles:EDGE; single or parts "
           "[float,zip,scanlines,single]")
        ->type_name("WORDS");
    app.add_option("--view", options.view.view,
                   "view of PNG, JPEG and TIFF in the OpenColorIO config ($OCIO, or the built-in one)")
        ->type_name("NAME");
    app.add_option("--display", options.view.display,
                   "display of PNG, JPEG and TIFF in the OpenColorIO config")
        ->type_name("NAME");
    app.add_option("--look", options.view.look,
                   "looks of PNG, JPEG and TIFF, in place of the looks of the view")
        ->type_name("NAMES");
    app.add_option(
           "--exposure", options.exposure,
           "exposure of PNG, JPEG and TIFF; default: 0, or automatic for renders of glTF files with lights")
        ->type_name("STOPS")
        ->transform(finiteNumber<float>());
}

} // namespace strobe
