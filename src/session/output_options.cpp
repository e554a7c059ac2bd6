#include "session/output_options.h"

#include "cli/option_validators.h"
#include "core/util/error.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdlib>

namespace strobe {
namespace {

ExrSettings exrCalled(const std::string& words) {
    try {
        return parseExrSettings(words);
    } catch (const Error& e) {
        throw CLI::ValidationError("--exr", e.what());
    }
}

} // namespace

void addPictureOptions(CLI::App& app, PictureOptions& options) {
    if (const char* file = std::getenv("OCIO"))
        options.color = std::make_shared<const ColorConfig>(file);
    app.add_option_function<std::string>(
        "--exr", [&options](const std::string& words) { options.exr = exrCalled(words); },
        "how EXRs are stored, words with commas between: float or half; none, rle, zips, "
        "zip, piz, pxr24, b44, b44a, dwaa or dwab; scanlines or tiles:EDGE; single or parts");
    app.add_option("--view", options.view.view,
                   "of the OpenColorIO config ($OCIO, or a built-in one): what PNGs show");
    app.add_option("--display", options.view.display, "of the config: what PNGs are for");
    app.add_option("--look", options.view.look, "of the config: in place of the view's own");
    app.add_option("--exposure", options.exposure, "of PNGs, in stops")->transform(finiteNumber<float>());
}

OutputSettings outputSettingsOf(const PictureOptions& options, int threads) {
    OutputSettings settings{options.exposure, {}, options.exr, threads};
    if (!options.view.isDefault())
        settings.view = options.color->view(options.view);
    settings.exr.colorSpace = options.color->workingSpace();
    return settings;
}

void addViewMetadata(const PictureOptions& options, Metadata& metadata) {
    for (const auto& [name, value] : {std::pair("display", options.view.display),
                                      {"view", options.view.view},
                                      {"look", options.view.look}})
        if (!value.empty())
            metadata.emplace_back(std::string("strobe:") + name, value);
    if (options.exposure != 0)
        metadata.emplace_back("strobe:exposure", fmt::format("{}", options.exposure)); // PNGs keep words only
}

} // namespace strobe
