// Measures ray rates of Embree alone, of strobe::Tracer and of the renderer. See bench/README.md.
#include "bench/embree_scene.h"
#include "bench/measure.h"
#include "bench/recording.h"
#include "bench/tracing.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <tbb/info.h>

namespace strobe::bench {
namespace {

/// The command line arguments.
struct Settings {
    std::vector<std::filesystem::path> scenes;
    BuildOptions build;
    std::vector<float> crop;
    uint64_t cameraRays = 2400000; ///< many, so that the start and the end of a render have little influence
    int repeats = 7;
    double seconds = 0.2;
};

/// The cost of tracing one kind of rays in one way.
struct Traced {
    Costs cost;
    uint64_t hits = 0; ///< hits, or occluded rays; must be equal for all ways
};
/// Camera, shadow or bounce rays, traced by Embree alone and by strobe::Tracer.
struct Kind {
    uint64_t rays = 0;
    Traced embree, tracer;
};

/// The measurements of one scene on one number of threads.
struct Result {
    Kind camera, shadow, bounce;
    Costs visibility, render;
    Counters counters; ///< of one render
};

/// Traces all packets repeatedly for at least `seconds`. Returns the cost of one repeat.
template <class Trace>
Cost costOfTracing(const std::vector<Packet>& packets, int threads, double seconds, uint64_t& hits,
                   const Trace& trace) {
    // The CPU time of threads on other cores is delayed by a tick or two, so short measurements are
    // inaccurate.
    int rounds = 0;
    const double start = wallSeconds();
    const Cost cost = measure([&] {
        do {
            hits = traceAll(packets, threads, trace);
            ++rounds;
        } while (wallSeconds() - start < seconds);
    });
    return {cost.cpu / rounds, cost.wall / rounds};
}

/// Traces and renders the subject once in all ways and adds the costs.
void measureOnce(const Subject& subject, const Recording& rays, const EmbreeScene& embree, int threads,
                 double seconds, Result& r) {
    const Tracer& tracer = subject.built.scene->tracer();
    const bool coherent = !embree.movingInstances();
    const auto trace = [&](const std::vector<Packet>& packets, Traced& result, const auto& work) {
        if (!packets.empty())
            result.cost.add(costOfTracing(packets, threads, seconds, result.hits, work));
    };
    const auto nearest = [](const auto& scene, bool flag) {
        return [&scene, flag](RayPacket& packet, int n) {
            scene.intersect(packet, n, flag);
            return countHits(packet, n);
        };
    };
    const auto shadow = [](const auto& scene) {
        return [&scene](RayPacket& packet, int n) {
            scene.occluded(packet, n);
            return countOccluded(packet, n);
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

/// A row of the tables.
struct Row {
    std::string scene;
    int threads;
    Result result;
};

/// Measures a scene after a warm-up.
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

/// Returns million rays per second.
double millions(uint64_t rays, double seconds) { return double(rays) / seconds * 1e-6; }

/// Returns the median of a / b over the repeats, in which other programs disturb both alike.
double pairedRatio(const std::vector<double>& a, const std::vector<double>& b) {
    std::vector<double> ratios;
    for (size_t i = 0; i < a.size(); ++i)
        ratios.push_back(a[i] / b[i]);
    return median(ratios);
}

/// Returns a ray rate as text, with its percentage of Embree's rate.
std::string rateOf(uint64_t rays, const std::vector<double>& seconds, const Costs& embree) {
    return fmt::format("{:.1f} ({:.0f} %)", millions(rays, median(seconds)),
                       pairedRatio(embree.cpu, seconds) * 100);
}

/// Returns the rates of Embree and of strobe::Tracer as cells of a table.
std::string ratesOf(const Kind& kind) {
    if (kind.rays == 0)
        return " | ";
    return fmt::format("{:.1f} | {}", millions(kind.rays, kind.embree.cost.medianCpu()),
                       rateOf(kind.rays, kind.tracer.cost.cpu, kind.embree.cost));
}

/// Prints the table of ray rates.
void printRates(const std::vector<Row>& rows) {
    fmt::print("Million rays per CPU second; in brackets, the percentage of Embree's rate with the same rays."
               "\n\n"
               "| scene | threads | camera: Embree | Tracer | renderer, visibility only | shadow: Embree | "
               "Tracer | bounce: Embree | Tracer | renderer, all rays | ± |\n"
               "|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (const Row& row : rows) {
        const Result& r = row.result;
        std::vector<double> embreeSeconds(r.render.cpu.size());
        for (const Kind* kind : {&r.camera, &r.shadow, &r.bounce})
            for (size_t i = 0; i < kind->embree.cost.cpu.size(); ++i)
                embreeSeconds[i] += kind->embree.cost.cpu[i];
        fmt::print("| {} | {} | {} | {} | {} | {} | {:.2f} ({:.0f} %) | {:.1f} % |\n", row.scene, row.threads,
                   ratesOf(r.camera), rateOf(r.camera.rays, r.visibility.cpu, r.camera.embree.cost),
                   ratesOf(r.shadow), ratesOf(r.bounce), millions(r.counters.rays(), r.render.medianCpu()),
                   pairedRatio(embreeSeconds, r.render.cpu) * 100, r.render.spread() * 100);
    }
    fmt::print("\nThe percentage of the last rate is Embree's CPU time for all rays over the CPU time of the "
               "renderer;\n± is half the interquartile range of the renderer's time.\n");
}

/// Prints the rays of the renderer, its rate, and the percentages of its stages.
void printRendering(const std::vector<Row>& rows) {
    fmt::print("\nThe renderer: rays, rate in wall-clock time, and percentages of the stages.\n\n"
               "| scene | threads | camera rays | shadow rays | other rays | M rays/s, wall clock |");
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

/// Returns whether Embree alone and the tracer have the same hits; prints an error otherwise. One ray in
/// 10,000 may differ, because the keys of rotations are decomposed twice.
bool agrees(const Row& row) {
    bool agree = true;
    for (const Kind* kind : {&row.result.camera, &row.result.shadow, &row.result.bounce}) {
        const double embreeHits = double(kind->embree.hits);
        const double tracerHits = double(kind->tracer.hits);
        if (std::abs(embreeHits - tracerHits) <= 1e-4 * double(kind->rays))
            continue;
        fmt::print(stderr, "error: {}: of {} rays, {} hit with Embree alone and {} with the tracer\n",
                   row.scene, kind->rays, embreeHits, tracerHits);
        agree = false;
    }
    return agree;
}

int run(const Settings& settings) {
    std::vector<Row> rows;
    bool agree = true;
    for (const auto& path : settings.scenes) {
        const Subject subject = loadScene(path, settings.build, settings.cameraRays);
        const Recording rays = record(subject);
        const EmbreeScene embree(*subject.built.scene, {});
        const int cores = tbb::info::default_concurrency();
        for (int threads : cores > 1 ? std::vector{1, cores} : std::vector{1}) {
            rows.push_back(measureScene(subject, rays, embree, threads, settings));
            agree &= agrees(rows.back());
        }
    }
    printRates(rows);
    printRendering(rows);
    return agree ? 0 : 1;
}

} // namespace
} // namespace strobe::bench

int main(int argc, char** argv) {
    strobe::bench::Settings settings;
    CLI::App app(
        "strobe_rates: measures the rays per second of Embree alone and of the renderer with the same rays");
    app.add_option("scene", settings.scenes, "scene files")->required()->check(CLI::ExistingFile);
    app.add_option("--shading", settings.build.shading, "shader (default: the scene's shader)");
    app.add_option("-D", settings.build.defines, "name=value: a parameter of the integrator or the shader")
        ->allow_extra_args(false);
    app.add_option("--spp", settings.build.samplesPerPixel, "samples per pixel (0: the scene's value)");
    app.add_option("--crop", settings.crop, "x0 x1 y0 y1: crop window in fractions of the frame")
        ->expected(4);
    app.add_option("--rays", settings.cameraRays, "approximate number of camera rays, spread over the frame");
    app.add_option("--seconds", settings.seconds, "minimum seconds of a measurement of tracing");
    app.add_option("--repeats", settings.repeats, "repeats; the medians are printed")
        ->check(CLI::PositiveNumber);
    CLI11_PARSE(app, argc, argv);
    if (!settings.crop.empty())
        settings.build.crop = {settings.crop[0], settings.crop[1], settings.crop[2], settings.crop[3]};
    return strobe::bench::guarded([&] { return strobe::bench::run(settings); });
}
