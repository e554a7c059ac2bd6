// How fast rays are traced: by Embree alone, through strobe::Tracer, and in the renderer. See
// bench/README.md.
#include "bench/embree_scene.h"
#include "bench/measure.h"
#include "bench/recording.h"
#include "bench/tracing.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <tbb/info.h>

namespace strobe::bench {
namespace {

struct Settings {
    std::vector<std::filesystem::path> scenes;
    BuildOptions build;
    std::vector<float> crop;
    uint64_t cameraRays = 2400000; ///< so that what begins and ends a render does not count
    int repeats = 7;
    double seconds = 0.2;
};

/// One way of tracing one kind of the recorded rays.
struct Traced {
    Costs cost;
    uint64_t found = 0; ///< hits, or blocked rays: two ways of tracing the same rays must agree
};
struct Kind {
    uint64_t rays = 0;
    Traced embree, tracer;
};

/// Medians over the repeats of one scene on one number of threads.
struct Result {
    Kind camera, shadow, bounce;
    Costs visibility, render;
    Counters counters; ///< of one render
};

/// Traces all packets as often as fills `seconds`; the cost of one time.
template <class Trace>
Cost costOfTracing(const std::vector<Packet>& packets, int threads, double seconds, uint64_t& found,
                   const Trace& trace) {
    // Clocks of a process lag by a tick or two for threads on other cores: short passes mislead.
    int rounds = 0;
    const double start = wallSeconds();
    const Cost cost = measure([&] {
        do {
            found = traceAll(packets, threads, trace);
            ++rounds;
        } while (wallSeconds() - start < seconds);
    });
    return {cost.cpu / rounds, cost.wall / rounds};
}

void measureOnce(const Subject& subject, const Recording& rays, const EmbreeScene& embree, int threads,
                 double seconds, Result& r) {
    const Tracer& tracer = subject.built.scene->tracer();
    const bool coherent = !embree.movingInstances();
    const auto trace = [&](const std::vector<Packet>& packets, Traced& result, const auto& work) {
        if (!packets.empty())
            result.cost.add(costOfTracing(packets, threads, seconds, result.found, work));
    };
    const auto nearest = [](const auto& scene, bool flag) {
        return [&scene, flag](RayPacket& b, int n) {
            scene.intersect(b, n, flag);
            return hitsOf(b, n);
        };
    };
    const auto shadow = [](const auto& scene) {
        return [&scene](RayPacket& b, int n) {
            scene.occluded(b, n);
            return blockedOf(b, n);
        };
    };
    trace(rays.camera, r.camera.embree, nearest(embree, coherent));
    trace(rays.camera, r.camera.tracer, nearest(tracer, true));
    r.visibility.add(measure([&] { renderVisibility(subject, threads); }));
    trace(rays.shadow, r.shadow.embree, shadow(embree));
    trace(rays.shadow, r.shadow.tracer, shadow(tracer));
    trace(rays.bounce, r.bounce.embree, nearest(embree, false));
    trace(rays.bounce, r.bounce.tracer, nearest(tracer, false));
    r.render.add(measure([&] { r.counters = renderWindows(subject, threads); }));
}

struct Row {
    std::string scene;
    int threads;
    Result result;
};

Row measureScene(const Subject& subject, const Recording& rays, const EmbreeScene& embree, int threads,
                 const Settings& settings) {
    Row row{subject.name, threads, {}};
    Result warmUp;
    measureOnce(subject, rays, embree, threads, settings.seconds, warmUp);
    for (int i = 0; i < settings.repeats; ++i)
        measureOnce(subject, rays, embree, threads, settings.seconds, row.result);
    row.result.camera.rays = rays.cameraRays;
    row.result.shadow.rays = rays.shadowRays;
    row.result.bounce.rays = rays.bounceRays;
    return row;
}

double millions(uint64_t rays, double seconds) { return double(rays) / seconds * 1e-6; }

/// The median over the repeats of a / b: what else the machine does then disturbs both alike.
double pairedRatio(const std::vector<double>& a, const std::vector<double>& b) {
    std::vector<double> ratios;
    for (size_t i = 0; i < a.size(); ++i)
        ratios.push_back(a[i] / b[i]);
    return median(ratios);
}

/// A rate, and which fraction it is of Embree's with the same rays.
std::string rateOf(uint64_t rays, const std::vector<double>& seconds, const Costs& embree) {
    return fmt::format("{:.1f} ({:.0f} %)", millions(rays, median(seconds)),
                       pairedRatio(embree.cpu, seconds) * 100);
}

std::string ratesOf(const Kind& kind) {
    if (kind.rays == 0)
        return " | ";
    return fmt::format("{:.1f} | {}", millions(kind.rays, kind.embree.cost.medianCpu()),
                       rateOf(kind.rays, kind.tracer.cost.cpu, kind.embree.cost));
}

void printRates(const std::vector<Row>& rows) {
    fmt::print("Million rays per CPU second, that is, per core; in brackets of Embree alone with the same "
               "rays.\n\n"
               "| scene | threads | camera: Embree | Tracer | renderer, visibility only | shadow: Embree | "
               "Tracer | bounce: Embree | Tracer | renderer, all rays | ± |\n"
               "|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (const Row& row : rows) {
        const Result& r = row.result;
        std::vector<double> floor(r.render.cpu.size());
        for (const Kind* kind : {&r.camera, &r.shadow, &r.bounce})
            for (size_t i = 0; i < kind->embree.cost.cpu.size(); ++i)
                floor[i] += kind->embree.cost.cpu[i];
        fmt::print("| {} | {} | {} | {} | {} | {} | {:.2f} ({:.0f} %) | {:.1f} % |\n", row.scene, row.threads,
                   ratesOf(r.camera), rateOf(r.camera.rays, r.visibility.cpu, r.camera.embree.cost),
                   ratesOf(r.shadow), ratesOf(r.bounce), millions(r.counters.rays(), r.render.medianCpu()),
                   pairedRatio(floor, r.render.cpu) * 100, r.render.spread() * 100);
    }
    fmt::print(
        "\nThe last bracket is the share of the renderer's CPU time that Embree alone needs for all of "
        "its rays;\n± is half the distance of the quartiles of that time.\n");
}

void printRendering(const std::vector<Row>& rows) {
    fmt::print("\nThe renderer: its rays, its rate on the clock, and where its time goes.\n\n"
               "| scene | threads | camera rays | shadow rays | other rays | M rays/s on the clock |");
    std::string line = "|---|---|---|---|---|---|";
    for (int i = 0; i < kStageCount; ++i) {
        fmt::print(" {} |", toString(Stage(i)));
        line += "---|";
    }
    fmt::print("\n{}\n", line);
    for (const Row& row : rows) {
        const Counters& c = row.result.counters;
        double stages = 0;
        for (double s : c.seconds)
            stages += s;
        fmt::print("| {} | {} | {} | {} | {} | {:.2f} |", row.scene, row.threads, c.visibilitySamples,
                   c.shadowRays, c.lightRays + c.bounceRays,
                   millions(c.rays(), row.result.render.medianWall()));
        for (double s : c.seconds)
            fmt::print(" {:.1f} % |", s / stages * 100);
        fmt::print("\n");
    }
}

/// False, with a message, when Embree alone and the tracer found different things. Keys of a rotation are
/// decomposed twice: there, one ray in ten thousand may differ.
bool agrees(const Row& row) {
    bool ok = true;
    for (const Kind* kind : {&row.result.camera, &row.result.shadow, &row.result.bounce}) {
        const double a = double(kind->embree.found), b = double(kind->tracer.found);
        if (std::abs(a - b) <= 1e-4 * double(kind->rays))
            continue;
        fmt::print(stderr, "error: {}: of {} rays Embree alone finds {} hits, the tracer {}\n", row.scene,
                   kind->rays, a, b);
        ok = false;
    }
    return ok;
}

int run(const Settings& settings) {
    std::vector<Row> rows;
    bool ok = true;
    for (const auto& path : settings.scenes) {
        const Subject subject = loadScene(path, settings.build, settings.cameraRays);
        const Recording rays = record(subject);
        const EmbreeScene embree(*subject.built.scene, {});
        const int cores = tbb::info::default_concurrency();
        for (int threads : cores > 1 ? std::vector{1, cores} : std::vector{1}) {
            rows.push_back(measureScene(subject, rays, embree, threads, settings));
            ok &= agrees(rows.back());
        }
    }
    printRates(rows);
    printRendering(rows);
    return ok ? 0 : 1;
}

} // namespace
} // namespace strobe::bench

int main(int argc, char** argv) {
    strobe::bench::Settings settings;
    CLI::App app("strobe_rates: rays per second, of Embree alone and of the renderer, on the same rays");
    app.add_option("scene", settings.scenes, "scene files")->required()->check(CLI::ExistingFile);
    app.add_option("--shading", settings.build.shading, "what to shade with (default: as the scene says)");
    app.add_option("-D", settings.build.defines, "name=value for the integrator or the shading")
        ->allow_extra_args(false);
    app.add_option("--spp", settings.build.samplesPerPixel, "samples per pixel (0: as the scene says)");
    app.add_option("--crop", settings.crop, "x0 x1 y0 y1: part of the frame, fractions")->expected(4);
    app.add_option("--rays", settings.cameraRays, "camera rays to measure, about, spread over the frame");
    app.add_option("--seconds", settings.seconds, "length of one pass of tracing, at least");
    app.add_option("--repeats", settings.repeats, "repeats, of which medians are shown")
        ->check(CLI::PositiveNumber);
    CLI11_PARSE(app, argc, argv);
    if (!settings.crop.empty())
        settings.build.crop = {settings.crop[0], settings.crop[1], settings.crop[2], settings.crop[3]};
    return strobe::bench::guarded([&] { return strobe::bench::run(settings); });
}
