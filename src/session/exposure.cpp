#include "session/exposure.h"

#include "core/color/spectrum.h"
#include "core/image/image_format.h"
#include "gltf/import.h"

namespace strobe {
namespace {

bool isOfGltf(const RenderOptions& options) {
    return std::all_of(options.scenes.begin(), options.scenes.end(), gltf::isGltfName);
}

/// Returns the value that the given fraction of the values is below. Precondition: there is a value.
float quantile(std::vector<float>& values, double fraction) {
    const auto nth = values.begin() + ptrdiff_t(fraction * double(values.size() - 1));
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

/// Returns the luminances of all pixels, times `scale`.
std::vector<float> luminancesOf(const Image& image, float scale) {
    std::vector<float> out;
    out.reserve(image.pixels.size());
    for (const Rgb& c : image.pixels)
        out.push_back(luminance(c) * scale);
    return out;
}

} // namespace

bool hasAutomaticExposure(const RenderOptions& options, const FrameSetup& setup) {
    const auto& images = options.output.images;
    return !options.output.format.exposure && setup.isLitByGltf && isOfGltf(options) &&
           std::any_of(images.begin(), images.end(), [](const std::filesystem::path& image) {
               const auto format = imageFormatOf(image);
               return format && hasView(*format);
           });
}

float automaticExposure(const BuiltScene& built) {
    constexpr int kRows = 48, kSamples = 4;
    constexpr float kMedian = .25f, kHigh = 1;
    RenderSettings settings;
    settings.samplesPerPixel = built.sampler.sampler->roundCount(kSamples);
    std::vector<float> values;
    const int width = built.resolution.x, height = built.resolution.y, rows = std::min(kRows, height);
    for (int i = 0; i < rows; ++i) {
        const int y = int((int64_t(2 * i + 1) * height) / (2 * rows));
        Film film(width, height, {0, y, width, y + 1});
        render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler, *built.filter,
               settings, film);
        for (const float v : luminancesOf(film.image(), 1))
            if (v > 0)
                values.push_back(v);
    }
    if (values.empty())
        return 0;
    const float median = quantile(values, .5), high = quantile(values, .95);
    const float stops = std::min(std::log2(kMedian / median), std::log2(kHigh / high));
    return std::round(stops * 4) / 4;
}

void reportVisibility(const Film& film, const RenderStats& stats, const FrameJob& job,
                      const BuiltScene& built, const Log& log) {
    constexpr float kDark = .02f;
    if (!isOfGltf(job.options) || film.image().pixels.empty())
        return;
    if (stats.total.visibilitySamples > 0 && stats.total.missed == stats.total.visibilitySamples)
        return log.warn(
            "there is nothing to see: no surface is in the view of the camera; --camera selects another "
            "camera of the file");
    const float exposure = job.options.output.format.exposure.value_or(0);
    std::vector<float> values = luminancesOf(film.image(), std::exp2(exposure));
    const float brightest = quantile(values, .995), darkest = quantile(values, .05);
    if (brightest <= 0)
        return log.warn(
            "the image is black: {}",
            built.isLitByGltf
                ? "the lights of the file do not reach the surfaces in view"
                : "the default light does not reach the surfaces in view, as in a closed room; add "
                  "lights to the file, or place it in a scene with lights");
    if (brightest < kDark)
        log.warn("the image is nearly black; --exposure {:.0f} makes it brighter",
                 exposure + std::ceil(std::log2(.5f / brightest)));
    else if (darkest > 1)
        log.warn("the image is nearly white; --exposure {:.0f} makes it darker",
                 exposure - std::ceil(std::log2(darkest / .5f)));
}

} // namespace strobe
