// Tests renders in memory: two at once, cancellation, layers, changes between renders, errors.
#include <strobe/strobe.h>

#include <atomic>
#include <cstdio>
#include <thread>

using namespace strobe;

namespace {

std::atomic<int> failures{0};

void expect(bool condition, const char* what) {
    if (!condition) {
        std::printf("FAILED: %s\n", what);
        ++failures;
    }
}

SceneModel scene(const Rgb& color) {
    SceneModel scene;
    scene.setCamera("perspective", {{"fov", 40.0}}, lookAt({0, 1, 6}, {0, 0, 0}, {0, 1, 0}));
    scene.addLight("infinite", {{"L", Rgb(1)}});
    scene.addTexture("checks", false, "checkerboard", {{"tex1", color}, {"tex2", Rgb(.1f)}});
    ShapeSettings settings;
    settings.material = scene.addMaterial("matte", {{"Kd", TextureName{"checks"}}});
    settings.placement = {{M44f(), M44f().translate(V3f(1, 0, 0))}};
    settings.name = "ball";
    scene.addShape("sphere", {{"radius", 1.f}}, settings);
    TriangleMesh mesh; // deforms
    mesh.indices = {0, 1, 2};
    mesh.positions = {{{-3, -1, 0}, {3, -1, 0}, {0, -1, 4}}, {{-3, -1, 0}, {3, -1, 0}, {0, -2, 4}}};
    scene.addMesh(mesh);
    return scene;
}

PictureSettings settings(const char* integrator) {
    PictureSettings settings;
    settings.integrator = integrator;
    settings.samplesPerPixel = 16;
    settings.resolution = V2i(64, 48);
    settings.threads = 2;
    return settings;
}

void testTwoAtOnce() {
    for (const char* integrator : {"supersample", "msaa-cache", "adaptive-cache"}) {
        const Picture red = renderPicture(scene(Rgb(1, 0, 0)), settings(integrator));
        const Picture blue = renderPicture(scene(Rgb(0, 0, 1)), settings(integrator));
        Picture a, b;
        std::thread first([&] { a = renderPicture(scene(Rgb(1, 0, 0)), settings(integrator)); });
        std::thread second([&] { b = renderPicture(scene(Rgb(0, 0, 1)), settings(integrator)); });
        first.join();
        second.join();
        expect(a.image.pixels == red.image.pixels && b.image.pixels == blue.image.pixels,
               "two renders at once equal two alone");
        expect(a.image.pixels != b.image.pixels, "the scenes differ");
    }
}

void testModelsAreIndependent() {
    const SceneModel original = scene(Rgb(.5f));
    SceneModel changed = original;
    changed.addLight("point", {{"I", Rgb(50)}, {"from", V3f(0, 4, 4)}});
    const Picture before = renderPicture(original, settings("supersample"));
    const Picture brighter = renderPicture(std::move(changed), settings("supersample"));
    expect(renderPicture(original, settings("supersample")).image.pixels == before.image.pixels,
           "a model can be rendered again");
    expect(brighter.image.at(32, 24).x > before.image.at(32, 24).x, "a copy can be changed");
}

void testCancellation() {
    PictureSettings s = settings("supersample");
    s.samplesPerPixel = 1 << 12;
    std::atomic<double> progress{0};
    s.onProgress = [&](double fraction) { progress = fraction; };
    s.isCancelled = [&] { return progress > 0; };
    const Picture picture = renderPicture(scene(Rgb(.5f)), s);
    expect(!picture.isFinished && progress < 1, "a cancelled render ends early");
    expect(renderPicture(scene(Rgb(.5f)), settings("supersample")).isFinished, "others are finished");
}

void testLayers() {
    PictureSettings s = settings("supersample");
    s.aovs = {"depth", "albedo", "shades"};
    const Picture picture = renderPicture(scene(Rgb(.5f)), s);
    const std::vector<float>* shades = picture.layer("shades", "Y");
    expect(shades && shades->size() == 64 * 48, "layers have the size of the image");
    expect(picture.layer("albedo", "R") && !picture.layer("albedo", "Z"), "channels have names");
    s.aovs = {"dept"};
    try {
        renderPicture(scene(Rgb(.5f)), s);
        expect(false, "an unknown layer is an error");
    } catch (const Error&) {
    }
}

/// Returns the text of the error of a call; empty if there is none.
template <class Call>
std::string errorOf(const Call& call) {
    try {
        call();
        return "";
    } catch (const Error& e) {
        return e.what();
    }
}

void testErrors() {
    SceneModel model;
    expect(errorOf([&] { model.addShape("sphere", {}, {.material = 7}); }) == "there is no material 7",
           "unknown material");
    TriangleMesh mesh;
    mesh.positions = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
    mesh.indices = {0, 1, 3};
    expect(errorOf([&] { model.addMesh(mesh); }) == "a mesh has indices of its positions",
           "index out of range");
    model.addMaterial("mate");
    const std::string unknown = errorOf([&] { renderPicture(model, settings("supersample")); });
    expect(unknown.find("did you mean \"matte\"") != std::string::npos, unknown.c_str());
    SceneModel misspelt;
    misspelt.addMaterial("matte", {{"kd", Rgb(1)}});
    expect(!errorOf([&] { renderPicture(misspelt, settings("supersample")); }).empty(), "misspelt parameter");
}

} // namespace

int main() {
    testTwoAtOnce();
    testModelsAreIndependent();
    testCancellation();
    testLayers();
    testErrors();
    return failures == 0 ? 0 : 1;
}
