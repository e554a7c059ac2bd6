// Measures the cost of rigid motion in Embree, as instances and baked into vertices. See bench/README.md.
#include "bench/embree_scene.h"
#include "bench/measure.h"
#include "bench/recording.h"
#include "bench/tracing.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace strobe::bench {
namespace {

/// A representation of motion with its name in the tables.
struct Variant {
    const char* name;
    MotionChoice choice;
};
constexpr Variant kVariants[] = {
    {"static, world space", {MotionStyle::Baked, 1}},
    {"static instance", {MotionStyle::Matrix, 1}},
    {"instance, 2 matrices", {MotionStyle::Matrix, 2}},
    {"instance, 5 matrices", {MotionStyle::Matrix, 5}},
    {"instance, 2 quaternions", {MotionStyle::Quaternion, 2}},
    {"instance, 5 quaternions", {MotionStyle::Quaternion, 5}},
    {"baked, 2 keys", {MotionStyle::Baked, 2}},
    {"baked, 5 keys", {MotionStyle::Baked, 5}},
};
constexpr size_t kVariantCount = std::size(kVariants), kInstance2 = 2, kBaked2 = 6;

/// Returns a triangle mesh in the shape of a ball with 2 * segments * (rings - 1) triangles.
std::string ball(const V3f& center, float radius, int segments, int rings) {
    std::string points, indices;
    const auto add = [&](float theta, float phi) {
        points += fmt::format("{:.5g} {:.5g} {:.5g}  ", center.x + radius * std::sin(theta) * std::cos(phi),
                              center.y + radius * std::sin(theta) * std::sin(phi),
                              center.z + radius * std::cos(theta));
    };
    for (int r = 1; r < rings; ++r)
        for (int s = 0; s < segments; ++s)
            add(kPi * float(r) / float(rings), 2 * kPi * float(s) / float(segments));
    add(0, 0);
    add(kPi, 0);
    const int top = (rings - 1) * segments, bottom = top + 1;
    for (int s = 0; s < segments; ++s) {
        const int next = (s + 1) % segments;
        indices += fmt::format("{} {} {}  ", top, s, next);
        for (int r = 0; r + 2 < rings; ++r) {
            const int a = r * segments, b = a + segments;
            indices += fmt::format("{} {} {}  {} {} {}  ", a + s, b + s, b + next, a + s, b + next, a + next);
        }
        const int last = (rings - 2) * segments;
        indices += fmt::format("{} {} {}  ", last + s, bottom, last + next);
    }
    return fmt::format("Shape \"trianglemesh\" \"point3 P\" [{}] \"integer indices\" [{}]\n", points,
                       indices);
}

/// Returns a scene with side x side balls over a floor. Each moves by half a radius in a direction of its
/// own.
std::string ballScene(int side, int segments, int rings) {
    std::string text = R"(LookAt 0 -6 3  0 0 0.8  0 0 1
Camera "perspective" "float fov" 36
Film "image" "integer xresolution" 480 "integer yresolution" 480
Sampler "sobol" "integer pixelsamples" 16
PixelFilter "box"
Integrator "directlighting"
WorldBegin
AttributeBegin
  Material "matte" "rgb Kd" [0 0 0]
  AreaLightSource "diffuse" "rgb L" [100 100 100] "integer nsamples" 4
  Translate 3 -3 6
  Shape "sphere" "float radius" 0.3
AttributeEnd
Shape "trianglemesh" "integer indices" [0 1 2 2 3 0] "point3 P" [-9 -9 0  9 -9 0  9 9 0  -9 9 0]
)";
    const float radius = 1.f / float(side);
    for (int i = 0; i < side * side; ++i) {
        const float x = side > 1 ? 4 * (float(i % side) / float(side - 1) - 0.5f) : 0;
        const float y = side > 1 ? 4 * (float(i / side) / float(side - 1) - 0.5f) : 0;
        const float phi = 2.4f * float(i); // golden angle: all directions differ
        text += fmt::format("AttributeBegin\nActiveTransform EndTime\nTranslate {:.5g} {:.5g} {:.5g}\n"
                            "ActiveTransform All\n{}AttributeEnd\n",
                            radius * 0.4f * std::cos(phi), radius * 0.4f * std::sin(phi), radius * 0.3f,
                            ball(V3f(x, y, 1.2f * radius), radius, segments, rings));
    }
    return text;
}

/// The costs and the hits of one representation of motion.
struct Timing {
    Costs coherent, incoherent, shadow; ///< camera rays with and without Embree's coherent flag; shadow rays
    uint64_t hits = 0, blocked = 0;

    /// Returns the CPU seconds of the camera rays in repeat i as strobe traces them: baked vertices with the
    /// faster setting of the flag, moving instances without it, because with the flag hits of Embree 3.13
    /// depend on neighboring lanes.
    double camera(size_t i, bool instances) const {
        const bool flag = !instances && coherent.medianCpu() < incoherent.medianCpu();
        return flag ? coherent.cpu[i] : incoherent.cpu[i];
    }
};

/// The measurements of one scene.
struct Row {
    std::string name;
    size_t movingTriangles = 0, movingObjects = 0;
    bool rotates = false;
    uint64_t cameraRays = 0, shadowRays = 0;
    std::vector<Timing> timings{kVariantCount};
    Timing asRendered; ///< only the hits are used

    std::string objects() const {
        return fmt::format("{} x {}", movingObjects, movingTriangles / std::max<size_t>(1, movingObjects));
    }
};

/// Traces all recorded rays once and adds the costs.
void traceOnce(const EmbreeScene& embree, const Recording& rays, Timing& t) {
    for (bool coherent : {false, true})
        (coherent ? t.coherent : t.incoherent).add(measure([&] {
            t.hits = traceAll(rays.camera, 1, [&](RayPacket& packet, int n) {
                embree.intersect(packet, n, coherent);
                return countHits(packet, n);
            });
        }));
    t.shadow.add(measure([&] {
        t.blocked = traceAll(rays.shadow, 1, [&](RayPacket& packet, int n) {
            embree.occluded(packet, n);
            return countOccluded(packet, n);
        });
    }));
}

/// Measures all representations of motion of a scene; the first repeat is a warm-up.
Row measureSubject(const Subject& subject, int repeats) {
    const Scene& scene = *subject.built.scene;
    const Recording rays = record(subject);
    Row row;
    row.name = subject.name;
    row.cameraRays = rays.cameraRays;
    row.shadowRays = rays.shadowRays;
    for (const Instance& instance : scene.instances()) {
        if (instance.motion->isStatic())
            continue;
        ++row.movingObjects;
        row.rotates |= instance.motion->usesRotation();
        for (const Geometry& g : scene.groups()[instance.group].geometries)
            row.movingTriangles += g.placed.shape.mesh ? g.placed.shape.mesh->triangleCount() : 0;
    }
    traceOnce(EmbreeScene(scene, {}), rays, row.asRendered);
    std::vector<std::unique_ptr<EmbreeScene>> scenes;
    for (const Variant& variant : kVariants)
        scenes.push_back(std::make_unique<EmbreeScene>(scene, variant.choice));
    for (int i = 0; i <= repeats; ++i)
        for (size_t v = 0; v < kVariantCount; ++v) {
            Timing warmUp;
            traceOnce(*scenes[v], rays, i == 0 ? warmUp : row.timings[v]);
        }
    return row;
}

/// Returns whether the moving variants have the hits of the renderer's geometry; prints an error otherwise.
/// The tolerance is large for linear keys of a rotation, with which recorded shadow rays start slightly
/// inside their surface.
bool agrees(const Row& row) {
    bool agree = true;
    for (size_t v = 0; v < kVariantCount; ++v) {
        const Timing &a = row.timings[v], &b = row.asRendered;
        const bool approximate = row.rotates && kVariants[v].choice.style != MotionStyle::Quaternion;
        const double hits = std::abs(double(a.hits) - double(b.hits)) / double(row.cameraRays);
        const double blocked = std::abs(double(a.blocked) - double(b.blocked)) / double(row.shadowRays);
        if (kVariants[v].choice.keys == 1 || std::max(hits, blocked) < (approximate ? 0.05 : 0.001))
            continue;
        fmt::print(stderr, "error: {}, {}: {} hits and {} occluded rays, expected {} and {} as rendered\n",
                   row.name, kVariants[v].name, a.hits, a.blocked, b.hits, b.blocked);
        agree = false;
    }
    return agree;
}

/// Prints the ray rates of all variants.
void printTable(const std::vector<Row>& rows, const char* title, uint64_t Row::*rays, Costs Timing::*costs) {
    fmt::print(
        "{}, million rays per CPU second (one thread, Embree alone):\n\n| scene | objects x triangles |",
        title);
    for (const Variant& v : kVariants)
        fmt::print(" {} |", v.name);
    fmt::print("\n|---|---|");
    for (size_t v = 0; v < kVariantCount; ++v)
        fmt::print("---|");
    fmt::print("\n");
    for (const Row& row : rows) {
        fmt::print("| {} | {} |", row.name, row.objects());
        for (const Timing& t : row.timings)
            fmt::print(" {:.1f} |", double(row.*rays) / (t.*costs).medianCpu() * 1e-6);
        fmt::print("\n");
    }
    fmt::print("\n");
}

/// Prints the time of baked vertices over instances.
void printDecision(const std::vector<Row>& rows) {
    fmt::print(
        "Time of baked vertices (2 keys, faster setting of the flag) over instances (2 matrices, without the "
        "flag);\nbelow 1, baking is faster.\n\n"
        "| scene | objects x triangles | camera rays | shadow rays | all | ± |\n"
        "|---|---|---|---|---|---|\n");
    for (const Row& row : rows) {
        const Timing &baked = row.timings[kBaked2], &instance = row.timings[kInstance2];
        std::vector<double> camera, shadow;
        Costs all;
        for (size_t i = 0; i < baked.shadow.cpu.size(); ++i) {
            const double bakedSeconds = baked.camera(i, false);
            const double instanceSeconds = instance.camera(i, true);
            camera.push_back(bakedSeconds / instanceSeconds);
            shadow.push_back(baked.shadow.cpu[i] / instance.shadow.cpu[i]);
            all.cpu.push_back((bakedSeconds + baked.shadow.cpu[i]) /
                              (instanceSeconds + instance.shadow.cpu[i]));
        }
        fmt::print("| {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.1f} % |\n", row.name, row.objects(),
                   median(camera), median(shadow), median(all.cpu), all.spread() * 100);
    }
}

int run(const std::vector<std::filesystem::path>& scenes, uint64_t cameraRays, int repeats) {
    struct Ball {
        int side, segments, rings;
    };
    // 12, 48, 192, 1012, 4032 and 16256 triangles.
    constexpr Ball kBalls[] = {{1, 3, 3}, {1, 6, 5}, {1, 12, 9}, {1, 22, 24}, {1, 48, 43}, {1, 64, 128},
                               {8, 3, 3}, {8, 6, 5}, {8, 12, 9}, {8, 22, 24}, {8, 48, 43}, {32, 3, 3}};
    std::vector<Row> rows;
    bool agree = true;
    for (const Ball& b : kBalls) {
        rows.push_back(measureSubject(
            loadText("balls", ballScene(b.side, b.segments, b.rings), {}, cameraRays), repeats));
        agree &= agrees(rows.back());
    }
    for (const auto& path : scenes) {
        rows.push_back(measureSubject(loadScene(path, {}, cameraRays), repeats));
        agree &= agrees(rows.back());
    }
    printTable(rows, "Camera rays with the coherent flag", &Row::cameraRays, &Timing::coherent);
    printTable(rows, "Camera rays without the coherent flag", &Row::cameraRays, &Timing::incoherent);
    printTable(rows, "Shadow rays", &Row::shadowRays, &Timing::shadow);
    printDecision(rows);
    return agree ? 0 : 1;
}

} // namespace
} // namespace strobe::bench

int main(int argc, char** argv) {
    std::vector<std::filesystem::path> scenes;
    uint64_t cameraRays = 200000;
    int repeats = 7;
    CLI::App app(
        "strobe_motion: measures the cost of rigid motion in Embree, as instances and baked into vertices");
    app.add_option("scene", scenes, "scenes with rigidly moving meshes, in addition to the built-in scenes")
        ->check(CLI::ExistingFile);
    app.add_option("--rays", cameraRays, "approximate number of camera rays, spread over the frame");
    app.add_option("--repeats", repeats, "repeats; the medians are printed")->check(CLI::PositiveNumber);
    CLI11_PARSE(app, argc, argv);
    return strobe::bench::guarded([&] { return strobe::bench::run(scenes, cameraRays, repeats); });
}
