// Renders two scenes in turn to measure a small difference in time per ray. See bench/README.md.
#include "bench/measure.h"
#include "bench/recording.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace strobe::bench {
namespace {

/// Prints the median of the paired ratios with its distribution-free confidence interval.
void printRatios(std::vector<double> ratios) {
    std::sort(ratios.begin(), ratios.end());
    // The number of ratios below the median is binomial: excludes k ratios at either end while
    // P(<= k) < 2.5 %.
    const size_t n = ratios.size();
    double tail = 0;
    double term = std::pow(0.5, double(n));
    size_t k = 0;
    while (k < n / 2 && tail + term < 0.025) {
        tail += term;
        term *= double(n - k) / double(k + 1);
        ++k;
    }
    fmt::print("median of {} paired ratios: {:.4f}", n, median(ratios));
    if (k > 0)
        fmt::print(" (95 % interval {:.4f} … {:.4f})", ratios[k - 1], ratios[n - k]);
    fmt::print("\n");
}

int run(const std::vector<std::filesystem::path>& scenes, const BuildOptions& options, uint64_t cameraRays,
        int pairs) {
    const Subject subjects[2] = {loadScene(scenes[0], options, cameraRays),
                                 loadScene(scenes[1], options, cameraRays)};
    Costs costs[2];
    uint64_t rays[2] = {};
    std::vector<double> ratios, traceRatios;
    for (int i = -1; i < pairs; ++i) {
        double secondsPerRay[2];
        double traceSeconds[2];
        for (int turn = 0; turn < 2; ++turn) {
            const int k = (i + turn) & 1; // alternates the order
            Counters counters;
            const Cost cost = measure([&] { counters = renderWindows(subjects[k], 1); });
            rays[k] = counters.rays();
            secondsPerRay[k] = cost.cpu / double(rays[k]);
            traceSeconds[k] = counters.seconds[size_t(Stage::Trace)];
            if (i >= 0) // the first turn is a warm-up
                costs[k].add(cost);
        }
        if (i < 0)
            continue;
        ratios.push_back(secondsPerRay[1] / secondsPerRay[0]);
        traceRatios.push_back(traceSeconds[1] / traceSeconds[0]);
    }
    for (int k = 0; k < 2; ++k)
        fmt::print("{}: {} rays, {:.2f} ns per ray (± {:.1f} %)\n", subjects[k].name, rays[k],
                   costs[k].medianCpu() / double(rays[k]) * 1e9, costs[k].spread() * 100);
    fmt::print("ratio of median CPU seconds per ray: {:.4f}\n",
               costs[1].medianCpu() / double(rays[1]) / (costs[0].medianCpu() / double(rays[0])));
    printRatios(ratios);
    fmt::print("ratio of the trace stages (camera rays, wall-clock time): {:.4f}\n", median(traceRatios));
    return 0;
}

} // namespace
} // namespace strobe::bench

int main(int argc, char** argv) {
    std::vector<std::filesystem::path> scenes;
    std::vector<float> crop;
    strobe::BuildOptions options;
    uint64_t cameraRays = 200000;
    int pairs = 21;
    CLI::App app(
        "strobe_pair: measures the CPU time per ray of scene B over scene A, rendered in turn on one thread");
    app.add_option("scene", scenes, "scene files A and B")->required()->expected(2)->check(CLI::ExistingFile);
    app.add_option("--spp", options.samplesPerPixel, "samples per pixel (0: the scene's value)");
    app.add_option("--crop", crop, "x0 x1 y0 y1: crop window in fractions of the frame")->expected(4);
    app.add_option("--rays", cameraRays,
                   "approximate number of camera rays per render, spread over the frame");
    app.add_option("--pairs", pairs, "renders of each scene")->check(CLI::PositiveNumber);
    CLI11_PARSE(app, argc, argv);
    if (!crop.empty())
        options.crop = {crop[0], crop[1], crop[2], crop[3]};
    return strobe::bench::guarded([&] { return strobe::bench::run(scenes, options, cameraRays, pairs); });
}
