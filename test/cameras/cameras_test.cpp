#include "cameras/environment.h"
#include "cameras/orthographic.h"
#include "cameras/perspective.h"
#include "cameras/shutter.h"
#include "support/chi_square.h"
#include "support/params.h"

#include <gtest/gtest.h>

using namespace strobe;
using namespace strobe::test;

namespace {

using CameraPlugin = Plugin<std::shared_ptr<const Camera>, const CameraArgs&>;

std::shared_ptr<const Camera> make(const CameraPlugin& plugin, const V2i& resolution,
                                   const ParamSet& params = {}, const KeyedTransform& toWorld = {},
                                   Shutter shutter = {0, 1}) {
    static Diagnostics quiet;
    return plugin.create(params, BuildContext{.diagnostics = quiet},
                         CameraArgs{toWorld, resolution, shutter});
}

Ray rayAt(const Camera& camera, const V2f& film, float time = 0, const V2f& lens = V2f(.5f)) {
    const CameraSample sample{film, lens, time};
    Ray ray;
    camera.rays(&sample, 1, &ray);
    return ray;
}

void expectDirection(const V3f& d, const V3f& expected, const char* label = "") {
    EXPECT_NEAR(length(d), 1, 1e-6) << label;
    EXPECT_NEAR(length(d - normalize(expected)), 0, 2e-6) << label << " " << d;
}

/// Returns a transform that scales, rotates around (1,2,3) and translates.
M44f placement(const V3f& scale, float degrees, const V3f& t) {
    M44f s, r, m;
    s.setScale(scale);
    r.setAxisAngle(V3f(1, 2, 3), radians(degrees));
    m.setTranslation(t);
    return s * r * m;
}

/// Returns the size of a pixel at distance 1, from finite differences of rays.
float measuredSpread(const Camera& camera, const V2f& film) {
    const float h = .25f;
    const V3f dx = (rayAt(camera, film + V2f(h, 0)).d - rayAt(camera, film - V2f(h, 0)).d) / (2 * h);
    const V3f dy = (rayAt(camera, film + V2f(0, h)).d - rayAt(camera, film - V2f(0, h)).d) / (2 * h);
    return std::sqrt(length(cross(dx, dy)));
}

} // namespace

TEST(Cameras, SoAMethodsEqualScalarMethods) {
    const KeyedTransform fixed(placement({2, 2, 2}, 40, {1, 2, 3}));
    const KeyedTransform moving({0, 1}, {placement(V3f(1), 40, {1, 2, 3}), placement(V3f(1), 70, {1, 0, 3})},
                                MotionConvention::ObjectToWorld);
    const ParamSet lens = Params().floats("lensradius", {.2f}).floats("focaldistance", {4});
    for (const auto& camera :
         {make(perspectivePlugin(), {100, 60}, {}, fixed), make(perspectivePlugin(), {100, 60}, lens, fixed),
          make(perspectivePlugin(), {100, 60}, lens, moving),
          make(orthographicPlugin(), {100, 60}, {}, fixed),
          make(environmentPlugin(), {100, 60}, {}, moving)}) {
        CameraSampleSoA samples;
        CameraRaySoA rays;
        for (int i = 0; i < kSoAWidth; ++i) {
            samples.film.set(i, random2D(1, i) * 100.f);
            samples.lens.set(i, random2D(2, i));
            samples.time[i] = random2D(3, i).x;
        }
        camera->raySoA(samples, kSoAWidth - 5, rays);
        float width[kSoAWidth], spread[kSoAWidth];
        camera->coneSoA(samples.film, kSoAWidth - 5, width, spread);
        V3SoA viewpoints;
        camera->viewpointSoA(rays.d, samples.lens, samples.time, kSoAWidth - 5, viewpoints);
        for (int i = 0; i < kSoAWidth - 5; ++i) {
            const RayCone cone = camera->cone(samples.film.at(i));
            EXPECT_EQ(cone.width, width[i]);
            EXPECT_EQ(cone.spread, spread[i]);
            EXPECT_EQ(camera->viewpoint(rays.d.at(i), samples.lens.at(i), samples.time[i]), viewpoints.at(i));
            const Ray ray = rayAt(*camera, samples.film.at(i), samples.time[i], samples.lens.at(i));
            EXPECT_EQ(ray.o, rays.o.at(i));
            EXPECT_EQ(ray.d, rays.d.at(i));
        }
    }
}

TEST(Perspective, LooksAlongZWithRightAndUp) {
    const auto camera = make(perspectivePlugin(), {100, 100}); // 90 degrees
    expectDirection(rayAt(*camera, {50, 50}).d, {0, 0, 1}, "center");
    expectDirection(rayAt(*camera, {100, 50}).d, {1, 0, 1}, "right");
    expectDirection(rayAt(*camera, {50, 0}).d, {0, 1, 1}, "top");
    expectDirection(rayAt(*camera, {0, 0}).d, {-1, 1, 1}, "top left");
    EXPECT_EQ(rayAt(*camera, {3, 4}, .25f).time, .25f);
    EXPECT_EQ(rayAt(*camera, {3, 4}).o, V3f(0));
    EXPECT_FALSE(camera->hasLens());
    EXPECT_FALSE(camera->moves());
}

TEST(Perspective, FovSpansTheShorterAxis) {
    const float t = std::tan(radians(20));
    const Params fov = Params().floats("fov", {40});
    expectDirection(rayAt(*make(perspectivePlugin(), {200, 100}, fov), {200, 0}).d, {2 * t, t, 1},
                    "landscape");
    expectDirection(rayAt(*make(perspectivePlugin(), {100, 200}, fov), {100, 0}).d, {t, 2 * t, 1},
                    "portrait");
    const Params half = Params().floats("halffov", {20});
    expectDirection(rayAt(*make(perspectivePlugin(), {200, 100}, half), {200, 0}).d, {2 * t, t, 1},
                    "halffov");
    const Params square = Params().floats("fov", {40}).floats("frameaspectratio", {1});
    expectDirection(rayAt(*make(perspectivePlugin(), {200, 100}, square), {200, 0}).d, {t, t, 1}, "aspect");
}

TEST(Perspective, ScreenWindowBoundsTheImage) {
    const auto camera = make(perspectivePlugin(), {10, 20}, Params().floats("screenwindow", {-1, 3, 0, 2}));
    expectDirection(rayAt(*camera, {0, 0}).d, {-1, 2, 1});
    expectDirection(rayAt(*camera, {10, 20}).d, {3, 0, 1});
    expectDirection(rayAt(*camera, {5, 10}).d, {1, 1, 1});
}

TEST(Perspective, RaysAreInWorldSpace) {
    const M44f m = placement({-1, 1, 1}, 40, {5, 6, 7});
    const auto camera = make(perspectivePlugin(), {100, 100}, {}, KeyedTransform(m));
    const Ray ray = rayAt(*camera, {100, 50});
    EXPECT_NEAR(length(ray.o - V3f(5, 6, 7)), 0, 1e-5);
    expectDirection(ray.d, transformVector(m, {1, 0, 1}));
    EXPECT_NEAR(length(camera->position(.3f) - V3f(5, 6, 7)), 0, 1e-5);
}

TEST(Perspective, LensRaysMeetAtTheFocalPlane) {
    const auto camera =
        make(perspectivePlugin(), {100, 80},
             Params().floats("lensradius", {.5f}).floats("focaldistance", {7}).floats("fov", {60}));
    ASSERT_TRUE(camera->hasLens());
    for (const V2f& film : {V2f(50, 40), V2f(3, 70), V2f(99, 1)}) {
        const Ray middle = rayAt(*camera, film);
        const V3f focus = middle.o + middle.d * (7 / middle.d.z);
        float maxRadius = 0;
        for (int i = 0; i < 200; ++i) {
            const Ray ray = rayAt(*camera, film, 0, random2D(1, i));
            EXPECT_NEAR(ray.o.z, 0, 1e-6);
            EXPECT_NEAR(length(ray.d), 1, 1e-6);
            EXPECT_NEAR(length(ray.o + ray.d * ((7 - ray.o.z) / ray.d.z) - focus), 0, 2e-5);
            maxRadius = std::max(maxRadius, length(ray.o));
        }
        EXPECT_GT(maxRadius, .45f);
        EXPECT_LE(maxRadius, .5f + 1e-6f);
    }
    // The square of the default focal distance of pbrt overflows.
    const auto far = make(perspectivePlugin(), {10, 10},
                          Params().floats("lensradius", {1}).floats("focaldistance", {1e30f}));
    expectDirection(rayAt(*far, {5, 5}, 0, {.9f, .5f}).d, {0, 0, 1});
}

TEST(Cameras, MovingCameraFollowsItsKeys) {
    M44f end;
    end.setTranslation(V3f(10, 0, 0));
    const KeyedTransform slide({0, 1}, {M44f(), end}, MotionConvention::ObjectToWorld);
    for (const CameraPlugin& plugin : {perspectivePlugin(), orthographicPlugin(), environmentPlugin()}) {
        const auto camera = make(plugin, {10, 10}, {}, slide, {.2f, .6f});
        EXPECT_TRUE(camera->moves()) << plugin.name;
        const V3f start = rayAt(*camera, {5, 5}, 0).o;
        EXPECT_NEAR(start.x, 2, 1e-4) << plugin.name;
        EXPECT_NEAR(rayAt(*camera, {5, 5}, .5f).o.x, 4, 1e-4) << plugin.name;
        EXPECT_NEAR(rayAt(*camera, {5, 5}, 1).o.x, 6, 1e-4) << plugin.name;
        EXPECT_NEAR(camera->position(.5f).x, 4, 1e-4) << plugin.name;
        const auto instant = make(plugin, {10, 10}, {}, slide, {.5f, .5f});
        EXPECT_FALSE(instant->moves()) << "the shutter interval is empty";
        EXPECT_NEAR(rayAt(*instant, {5, 5}, 1).o.x, 5, 1e-4) << plugin.name;
        const auto late = make(plugin, {10, 10}, {}, slide, {3, 4});
        EXPECT_FALSE(late->moves()) << "the shutter opens after the last key";
        EXPECT_NEAR(rayAt(*late, {5, 5}, 0).o.x, 10, 1e-4) << plugin.name;
    }
}

TEST(Orthographic, RaysAreParallelAndStartOnTheScreenWindow) {
    const auto camera =
        make(orthographicPlugin(), {200, 100}, Params().floats("screenwindow", {-4, 4, -2, 2}));
    for (const V2f& film : {V2f(0, 0), V2f(200, 100), V2f(50, 50)}) {
        const Ray ray = rayAt(*camera, film);
        expectDirection(ray.d, {0, 0, 1});
        EXPECT_NEAR(length(ray.o - V3f(-4 + film.x * .04f, 2 - film.y * .04f, 0)), 0, 1e-5);
    }
    const RayCone cone = camera->cone({3, 4});
    EXPECT_NEAR(cone.width, .04, 1e-6);
    EXPECT_EQ(cone.spread, 0);
    const auto scaled =
        make(orthographicPlugin(), {200, 100}, Params().floats("screenwindow", {-4, 4, -2, 2}),
             KeyedTransform(placement(V3f(3), 20, V3f(1))));
    EXPECT_NEAR(scaled->cone({3, 4}).width, .12, 1e-6);
}

TEST(Orthographic, LensRaysMeetAtTheFocalPlane) {
    const auto camera = make(orthographicPlugin(), {100, 100},
                             Params().floats("lensradius", {.2f}).floats("focaldistance", {5}));
    ASSERT_TRUE(camera->hasLens());
    const Ray middle = rayAt(*camera, {20, 70});
    for (int i = 0; i < 100; ++i) {
        const Ray ray = rayAt(*camera, {20, 70}, 0, random2D(2, i));
        EXPECT_NEAR(length(ray.o + ray.d * (5 / ray.d.z) - (middle.o + middle.d * 5)), 0, 1e-5);
    }
}

TEST(Environment, CoversAllDirections) {
    const auto camera = make(environmentPlugin(), {400, 200});
    expectDirection(rayAt(*camera, {0, 100}).d, {1, 0, 0});
    expectDirection(rayAt(*camera, {100, 100}).d, {0, 0, 1});
    expectDirection(rayAt(*camera, {33, 0}).d, {0, 1, 0});
    expectDirection(rayAt(*camera, {33, 200}).d, {0, -1, 0});
}

TEST(Cameras, ConeIsOnePixelWide) {
    const Params fov = Params().floats("fov", {100});
    for (const M44f& m : {M44f(), placement(V3f(5), 30, V3f(1, 2, 3)), placement({-1, 1, 1}, 70, V3f(0)),
                          placement({1, 2, 1}, 10, V3f(0))}) {
        const KeyedTransform t(m);
        for (const V2f& film : {V2f(160, 120), V2f(5, 5), V2f(300, 100), V2f(319.5f, 239.5f)}) {
            const auto camera = make(perspectivePlugin(), {320, 240}, fov, t);
            EXPECT_EQ(camera->cone(film).width, 0);
            EXPECT_NEAR(camera->cone(film).spread / measuredSpread(*camera, film), 1, 2e-3) << film;
            if (m[0][0] > 4 || m == M44f()) { // not for non-uniform scaling
                const auto round = make(environmentPlugin(), {320, 240}, {}, t);
                EXPECT_NEAR(round->cone(film).spread / measuredSpread(*round, film), 1, 1e-2) << film;
            }
        }
    }
    // The solid angles of all pixels sum to 4π.
    const auto round = make(environmentPlugin(), {64, 32});
    double sum = 0;
    for (int y = 0; y < 32; ++y)
        sum += 64 * sqr(round->cone({.5f, float(y) + .5f}).spread);
    EXPECT_NEAR(sum / (4 * M_PI), 1, 1e-5);
}

TEST(Cameras, ManyRaysEqualSingleRays) {
    M44f end;
    end.setAxisAngle(V3f(0, 1, 0), 1.f);
    const auto camera = make(perspectivePlugin(), {32, 32}, Params().floats("lensradius", {1}),
                             KeyedTransform({0, 1}, {M44f(), end}, MotionConvention::ObjectToWorld));
    std::vector<CameraSample> samples;
    for (int i = 0; i < 50; ++i)
        samples.push_back({random2D(1, i) * 32.f, random2D(2, i), random1D(9, i)});
    std::vector<Ray> rays(50);
    camera->rays(samples.data(), 50, rays.data());
    for (int i = 0; i < 50; ++i) {
        const Ray ray = rayAt(*camera, samples[i].film, samples[i].time, samples[i].lens);
        EXPECT_EQ(ray.o, rays[i].o);
        EXPECT_EQ(ray.d, rays[i].d);
        EXPECT_EQ(ray.time, rays[i].time);
    }
}

TEST(Cameras, ShutterIsReadAndErrorsHaveLocations) {
    const Shutter shutter = readShutter(Params().floats("shutteropen", {.25f}).floats("shutterclose", {.5f}));
    EXPECT_EQ(shutter.open, .25f);
    EXPECT_EQ(shutter.close, .5f);
    EXPECT_EQ(readShutter({}).close, 1);
    EXPECT_EQ(
        errorOffset([] { readShutter(Params().floats("shutteropen", {2}).floats("shutterclose", {1})); }),
        20);
    EXPECT_EQ(errorOffset([] { readShutter(Params().floats("shutteropen", {2})); }), 10);
    const auto fails = [](const ParamSet& p) {
        return errorOffset([&] { make(perspectivePlugin(), {4, 4}, p); });
    };
    EXPECT_EQ(fails(Params().floats("fov", {180})), 10);
    EXPECT_EQ(fails(Params().floats("fov", {30}).floats("halffov", {15})), 20);
    EXPECT_EQ(fails(Params().floats("screenwindow", {0, 1, 2})), 10);
    EXPECT_EQ(fails(Params().floats("screenwindow", {0, 0, 1, 2})), 10);
    EXPECT_EQ(fails(Params().floats("lensradius", {-1})), 10);
    EXPECT_EQ(fails(Params().floats("lensradius", {1}).floats("focaldistance", {0})), 20);
    EXPECT_EQ(fails(Params().floats("frameaspectratio", {0})), 10);
}

TEST(Cameras, ViewpointIsTheOriginOfTheRayThroughAPoint) {
    const KeyedTransform slide({0, 1}, {placement(V3f(1), 20, V3f(0)), placement(V3f(1), 20, V3f(3, 1, 0))},
                               MotionConvention::ObjectToWorld);
    const auto lens = Params().floats("lensradius", {.3f}).floats("focaldistance", {5});
    for (const auto& camera :
         {make(perspectivePlugin(), {40, 30}, lens, slide), make(perspectivePlugin(), {40, 30}, {}, slide),
          make(orthographicPlugin(), {40, 30}, lens, slide), make(orthographicPlugin(), {40, 30}, {}, slide),
          make(environmentPlugin(), {40, 30}, {}, slide)})
        for (int i = 0; i < 50; ++i) {
            const V2f u = random2D(1, i), film = random2D(2, i) * V2f(40, 30);
            const float time = random2D(3, i).x;
            const Ray ray = rayAt(*camera, film, time, u);
            const V3f seen = camera->viewpoint(ray.o + ray.d * 7.f, u, time);
            EXPECT_NEAR(length(seen - ray.o), 0, 1e-4);
        }
}

TEST(Cameras, ProjectReturnsTheFilmPointOfARay) {
    const KeyedTransform slide({0, 1}, {placement(V3f(2), 20, V3f(0)), placement(V3f(2), 50, V3f(3, 1, 0))},
                               MotionConvention::ObjectToWorld);
    const V2i size(40, 30);
    for (const auto& camera :
         {make(perspectivePlugin(), size, Params().floats("fov", {70}), slide),
          make(orthographicPlugin(), size, {}, slide), make(environmentPlugin(), size, {}, slide)})
        for (int i = 0; i < 50; ++i) {
            const V2f film = random2D(2, i) * V2f(40, 30);
            const float time = random1D(3, i);
            const Ray ray = rayAt(*camera, film, time);
            const auto seen = camera->project(ray.o + ray.d * 7.f, time);
            ASSERT_TRUE(seen);
            EXPECT_NEAR((seen->film - film).length(), 0, 1e-3) << film;
        }
}

TEST(Cameras, PointsInFocusProjectToTheirFilmPoint) {
    const auto lens = Params().floats("lensradius", {.3f}).floats("focaldistance", {5});
    for (const auto& camera :
         {make(perspectivePlugin(), {40, 30}, lens), make(orthographicPlugin(), {40, 30}, lens)})
        for (int i = 0; i < 50; ++i) {
            const V2f film = random2D(2, i) * V2f(40, 30);
            const Ray ray = rayAt(*camera, film, 0, random2D(1, i));
            const auto seen = camera->project(ray.o + ray.d * (5 / ray.d.z), 0);
            ASSERT_TRUE(seen);
            EXPECT_NEAR((seen->film - film).length(), 0, 1e-3);
            EXPECT_NEAR(seen->depth, 5, 1e-5);
        }
}

TEST(Cameras, DepthIsInSceneUnits) {
    const KeyedTransform large(placement({-3, 3, 3}, 0, {0, 0, 10}));
    for (const auto& plugin : {perspectivePlugin(), orthographicPlugin()}) {
        const auto camera = make(plugin, {40, 30}, {}, large);
        EXPECT_NEAR(camera->project({1, 1, 16}, 0)->depth, 6, 1e-5) << plugin.name;
        EXPECT_FALSE(camera->project({0, 0, 9}, 0)) << "the point is behind the camera";
    }
    const auto around = make(environmentPlugin(), {40, 30}, {}, large);
    EXPECT_NEAR(around->project({0, 3, 6}, 0)->depth, 5, 1e-5);
    EXPECT_FALSE(around->project({0, 0, 10}, 0));
}

TEST(Cameras, FilmStepWrapsForTheEnvironmentCamera) {
    const auto around = make(environmentPlugin(), {360, 180});
    EXPECT_EQ(around->filmStep({350, 40}, {5, 42}), V2f(15, 2));
    EXPECT_EQ(around->filmStep({5, 42}, {350, 40}), V2f(-15, -2));
    EXPECT_EQ(around->filmStep({100, 0}, {120, 0}), V2f(20, 0));
    EXPECT_EQ(make(perspectivePlugin(), {360, 180})->filmStep({350, 40}, {5, 42}), V2f(-345, 2));
}
