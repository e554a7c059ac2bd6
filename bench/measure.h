// Clocks, statistics and parallel loops of the benchmarks.
#pragma once

#include "core/scene/tracer.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <vector>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace strobe::bench {

/// Returns the CPU seconds of all threads of this process. Other programs disturb it less than wall-clock
/// time.
inline double cpuSeconds() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// Returns wall-clock seconds since an arbitrary time.
inline double wallSeconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The CPU time and the wall-clock time of a task.
struct Cost {
    double cpu = 0, wall = 0; ///< seconds
};

/// Returns the cost of work().
template <class Work>
Cost measure(Work&& work) {
    const double cpu = cpuSeconds();
    const double wall = wallSeconds();
    work();
    return {cpuSeconds() - cpu, wallSeconds() - wall};
}

/// Returns the median; the mean of the middle two values if their number is even, and 0 without values.
inline double median(std::vector<double> values) {
    if (values.empty())
        return 0;
    std::sort(values.begin(), values.end());
    const size_t n = values.size();
    return n % 2 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2;
}

/// The costs of repeated measurements.
struct Costs {
    std::vector<double> cpu, wall;
    void add(const Cost& cost) {
        cpu.push_back(cost.cpu);
        wall.push_back(cost.wall);
    }
    double medianCpu() const { return median(cpu); }
    double medianWall() const { return median(wall); }
    /// Returns half the interquartile range of `cpu` as a fraction of the median, or 0 for fewer than four
    /// values.
    double spread() const {
        if (cpu.size() < 4)
            return 0;
        std::vector<double> sorted = cpu;
        std::sort(sorted.begin(), sorted.end());
        return (sorted[sorted.size() * 3 / 4] - sorted[sorted.size() / 4]) / 2 / median(cpu);
    }
};

/// Calls work(begin, end) for chunks of [0, n) on `threads` threads. One thread: on the calling thread, in
/// order.
template <class Work>
void forChunks(size_t n, int threads, const Work& work) {
    constexpr size_t kChunk = 256;
    if (threads == 1) {
        const ScopedFlushDenormals fast;
        for (size_t i = 0; i < n; i += kChunk)
            work(i, std::min(i + kChunk, n));
        return;
    }
    tbb::task_arena(threads).execute([&] {
        tbb::parallel_for(tbb::blocked_range<size_t>(0, n, kChunk),
                          [&](const tbb::blocked_range<size_t>& range) {
                              const ScopedFlushDenormals fast;
                              work(range.begin(), range.end());
                          });
    });
}

} // namespace strobe::bench
