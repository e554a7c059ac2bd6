#include "api/render_picture.h"

#include "core/render/render.h"
#include "loader/build/builder.h"
#include "session/aov_recorder.h"

namespace strobe {

namespace {

BuildOptions buildOptions(const PictureSettings& settings, const PluginsPtr& plugins) {
    BuildOptions options;
    options.integrator = settings.integrator;
    options.shading = settings.shading;
    options.defines = settings.defines;
    options.samplesPerPixel = settings.samplesPerPixel;
    options.resolution = settings.resolution;
    options.pixelBounds = settings.pixelBounds;
    options.shutter = settings.shutter;
    options.transparent = settings.transparent;
    options.plugins = plugins;
    return options;
}

RenderSettings renderSettings(const PictureSettings& from, int samplesPerPixel) {
    RenderSettings settings;
    settings.samplesPerPixel = samplesPerPixel;
    settings.seed = from.seed;
    settings.clamp = from.clamp;
    settings.threads = from.threads;
    settings.onProgress = from.onProgress;
    settings.stop = from.isCancelled;
    return settings;
}

std::vector<Aov> aovsOf(const std::vector<std::string>& names) {
    std::vector<Aov> aovs;
    for (const std::string& name : names) {
        const AovInfo* info = findAov(name);
        if (!info)
            throw Error("unknown layer \"" + name + "\"", ErrorKind::Usage);
        aovs.push_back(info->aov);
    }
    return aovs;
}

} // namespace

const std::vector<float>* Picture::layer(const std::string& layer, const std::string& channel) const {
    for (const AovChannel& c : layers)
        if (c.layer == layer && c.name == channel)
            return &c.values;
    return nullptr;
}

Picture renderPicture(SceneModel scene, const PictureSettings& settings) {
    Diagnostics diagnostics(settings.onWarning ? settings.onWarning : [](const std::string&) {});
    const PluginsPtr plugins = scene.plugins();
    const BuiltScene built =
        buildScene(std::move(scene).release(), buildOptions(settings, plugins), diagnostics);
    RenderSettings render = renderSettings(settings, built.sampler.samplesPerPixel);
    const std::vector<Aov> aovs = aovsOf(settings.aovs);
    const Log log{[&](LogLevel, const std::string& text) { diagnostics.warn({}, text); }};
    AovRecorder recorder(aovs, OutputOptions().cryptomatteEntries, built, log);
    recorder.attachTo(render);
    const std::vector<Aov> sharing = aovsInGroup(aovs, AovGroup::Sharing);
    Film film(built.resolution.x, built.resolution.y, built.pixelBounds, sharing);
    Picture picture;
    picture.stats = strobe::render(*built.scene, *built.integrator, *built.shader, *built.sampler.sampler,
                                   *built.filter, render, film);
    picture.isFinished = picture.stats.passes > 0;
    picture.image = film.image();
    picture.resolution = built.resolution;
    picture.pixelBounds = built.pixelBounds;
    picture.layers = recorder.recorded().channels;
    for (const Aov aov : sharing)
        picture.layers.push_back({aovInfo(aov).name, "Y", film.plane(aov), false});
    return picture;
}

void writePicture(const Picture& picture, const std::filesystem::path& file) {
    Film film(picture.resolution.x, picture.resolution.y, picture.pixelBounds);
    film.addToImage(picture.image.pixels);
    const RecordedAovs aovs = recordedAovs(picture.layers);
    film.write(file, aovs.metadata, {}, aovs.parts, aovs.alpha);
}

} // namespace strobe
