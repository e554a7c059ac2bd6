// Builds a scene in memory, renders it and writes a picture: embed FILE
#include <strobe/strobe.h>

#include <cstdio>

using namespace strobe;

int main(int argc, char** argv) try {
    SceneModel scene;
    scene.setCamera("perspective", {{"fov", 40.0}}, lookAt({0, 2, 6}, {0, .7f, 0}, {0, 1, 0}));
    scene.addLight("infinite", {{"L", Rgb(.4f, .5f, .7f)}});
    scene.addLight("point", {{"from", V3f(-3, 5, 2)}, {"I", Rgb(30)}});
    TriangleMesh floor;
    floor.positions = {{{-9, 0, -9}, {9, 0, -9}, {9, 0, 9}, {-9, 0, 9}}};
    floor.indices = {0, 2, 1, 0, 3, 2};
    scene.addMesh(floor);
    ShapeSettings ball; // moves while the shutter is open
    ball.material = scene.addMaterial("plastic", {{"Kd", Rgb(.7f, .1f, .05f)}});
    ball.placement = {{M44f().translate(V3f(-.6f, 1, 0)), M44f().translate(V3f(.6f, 1, 0))}};
    scene.addShape("sphere", {{"radius", 1.f}}, ball);

    PictureSettings settings;
    settings.resolution = V2i(320, 240);
    settings.samplesPerPixel = 64;
    settings.integrator = "adaptive-cache";
    settings.onProgress = [](double fraction) { std::fprintf(stderr, "\r%3.0f %%", 100 * fraction); };
    const Picture picture = renderPicture(scene, settings);
    writePicture(picture, argc > 1 ? argv[1] : "picture.png");
    std::printf("\n%.1f s, %.1f million rays\n", picture.stats.seconds,
                double(picture.stats.total.rays()) / 1e6);
} catch (const Error& e) {
    std::fprintf(stderr, "error: %s\n", e.what());
    return 1;
}
