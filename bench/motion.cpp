// What rigid motion costs Embree, as instances and baked into vertices. See bench/README.md.
#include "bench/embree_scene.h"
#include "bench/measure.h"
#include "bench/recording.h"
#include "bench/tracing.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace strobe::bench {
namespace {

struct Variant {
    const char* name;
    MotionChoice choice;
};
constexpr Variant kVariants[] = {
    {"still, in the world", {MotionStyle::Baked, 1}},
    {"still, an instance", {MotionStyle::Matrix, 1}},
    {"instance, 2 matrices", {MotionStyle::Matrix, 2}},
    {"instance, 5 matrices", {MotionStyle::Matrix, 5}},
    {"instance, 2 quaternions", {MotionStyle::Quaternion, 2}},
    {"instance, 5 quaternions", {MotionStyle::Quaternion, 5}},
    {"baked, 2 keys", {MotionStyle::Baked, 2}},
    {"baked, 5 keys", {MotionStyle::Baked, 5}},
};
constexpr size_t kVariantCount = std::size(kVariants), kInstance2 = 2, kBaked2 = 6;

/// A closed surface of revolution, a ball when `rings` is large; 2 * segments * (rings - 1) triangles.
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

/// side x side balls that move by half a radius, each its own way, over a floor under a small round light.
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
        const float phi = 2.4f * float(i); // the golden angle: no two alike
        text += fmt::format("AttributeBegin\nActiveTransform EndTime\nTranslate {:.5g} {:.5g} {:.5g}\n"
                            "ActiveTransform All\n{}AttributeEnd\n",
                            radius * 0.4f * std::cos(phi), radius * 0.4f * std::sin(phi), radius * 0.3f,
                            ball(V3f(x, y, 1.2f * radius), radius, segments, rings));
    }
    return text;
}

struct Timing {
    Costs coherent, incoherent, shadow; ///< camera rays with and without Embree's flag; shadow rays
    uint64_t hits = 0, blocked = 0;

    /// CPU seconds of the camera rays in repeat i as strobe would trace them: baked vertices with the flag
    /// that suits them; moving instances without it, since with it Embree 3.13 lets neighbors change a hit.
    double camera(size_t i, bool instances) const {
        const bool flag = !instances && coherent.medianCpu() < incoherent.medianCpu();
        return flag ? coherent.cpu[i] : incoherent.cpu[i];
    }
};

struct Row {
    std::string name;
    size_t movingTriangles = 0, movingObjects = 0;
    bool rotates = false;
    uint64_t cameraRays = 0, shadowRays = 0;
    std::vector<Timing> timings{kVariantCount};
    Timing asRendered; ///< counts only

    std::string objects() const {
        return fmt::format("{} x {}", movingObjects, movingTriangles / std::max<size_t>(1, movingObjects));
    }
};

void traceOnce(const EmbreeScene& embree, const Recording& rays, Timing& t) {
    for (bool coherent : {false, true})
        (coherent ? t.coherent : t.incoherent).add(measure([&] {
            t.hits = traceAll(rays.camera, 1, [&](RayPacket& b, int n) {
                embree.intersect(b, n, coherent);
                return hitsOf(b, n);
            });
        }));
    t.shadow.add(measure([&] {
        t.blocked = traceAll(rays.shadow, 1, [&](RayPacket& b, int n) {
            embree.occluded(b, n);
            return blockedOf(b, n);
        });
    }));
}

Row measureSubject(const Subject& subject, int repeats) {
    const Scene& scene = *subject.built.scene;
    const Recording rays = record(subject);
    Row row;
    row.name = subject.name;
    row.cameraRays = rays.cameraRays, row.shadowRays = rays.shadowRays;
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

/// False, with a message, when a variant that moves finds clearly other things than the renderer's geometry:
/// then its rates mean nothing. Straight keys cut the corners of a rotation, and recorded shadow rays then
/// start a little inside their surface: for those only a gross difference counts.
bool agrees(const Row& row) {
    bool ok = true;
    for (size_t v = 0; v < kVariantCount; ++v) {
        const Timing &a = row.timings[v], &b = row.asRendered;
        const bool approximate = row.rotates && kVariants[v].choice.style != MotionStyle::Quaternion;
        const double hits = std::abs(double(a.hits) - double(b.hits)) / double(row.cameraRays);
        const double blocked = std::abs(double(a.blocked) - double(b.blocked)) / double(row.shadowRays);
        if (kVariants[v].choice.keys == 1 || std::max(hits, blocked) < (approximate ? 0.05 : 0.001))
            continue;
        fmt::print(stderr, "error: {}, {}: {} hits and {} blocked, but {} and {} as rendered\n", row.name,
                   kVariants[v].name, a.hits, a.blocked, b.hits, b.blocked);
        ok = false;
    }
    return ok;
}

void printTable(const std::vector<Row>& rows, const char* what, uint64_t Row::*rays, Costs Timing::*costs) {
    fmt::print(
        "{}, million rays per CPU second (one thread, Embree alone):\n\n| scene | objects x triangles |",
        what);
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

void printDecision(const std::vector<Row>& rows) {
    fmt::print(
        "Time of baked vertices (2 keys, with the better flag) over instances (2 matrices, without the "
        "flag): below 1,\nbaking is cheaper.\n\n"
        "| scene | objects x triangles | camera rays | shadow rays | all | ± |\n"
        "|---|---|---|---|---|---|\n");
    for (const Row& row : rows) {
        const Timing &baked = row.timings[kBaked2], &instance = row.timings[kInstance2];
        std::vector<double> camera, shadow;
        Costs all;
        for (size_t i = 0; i < baked.shadow.cpu.size(); ++i) {
            const double b = baked.camera(i, false), in = instance.camera(i, true);
            camera.push_back(b / in);
            shadow.push_back(baked.shadow.cpu[i] / instance.shadow.cpu[i]);
            all.cpu.push_back((b + baked.shadow.cpu[i]) / (in + instance.shadow.cpu[i]));
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
    bool ok = true;
    for (const Ball& b : kBalls) {
        rows.push_back(measureSubject(
            loadText("balls", ballScene(b.side, b.segments, b.rings), {}, cameraRays), repeats));
        ok &= agrees(rows.back());
    }
    for (const auto& path : scenes) {
        rows.push_back(measureSubject(loadScene(path, {}, cameraRays), repeats));
        ok &= agrees(rows.back());
    }
    printTable(rows, "Camera rays with the coherent flag", &Row::cameraRays, &Timing::coherent);
    printTable(rows, "Camera rays without it", &Row::cameraRays, &Timing::incoherent);
    printTable(rows, "Shadow rays", &Row::shadowRays, &Timing::shadow);
    printDecision(rows);
    return ok ? 0 : 1;
}

} // namespace
} // namespace strobe::bench

int main(int argc, char** argv) {
    std::vector<std::filesystem::path> scenes;
    uint64_t cameraRays = 200000;
    int repeats = 7;
    CLI::App app("strobe_motion: what rigid motion costs Embree, as instances and baked into vertices");
    app.add_option("scene", scenes, "scenes with rigidly moving meshes, besides those it makes itself")
        ->check(CLI::ExistingFile);
    app.add_option("--rays", cameraRays, "camera rays to measure, about, spread over the frame");
    app.add_option("--repeats", repeats, "repeats, of which medians are shown")->check(CLI::PositiveNumber);
    CLI11_PARSE(app, argc, argv);
    return strobe::bench::guarded([&] { return strobe::bench::run(scenes, cameraRays, repeats); });
}
