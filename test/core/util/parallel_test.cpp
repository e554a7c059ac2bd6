#include "core/util/parallel.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace strobe {
namespace {

// With ThreadSanitizer, this also tests that it sees the iterations ordered after the code before the loop,
// and before the code after it.
TEST(ParallelFor, ExecutesEachIterationOnce) {
    for (const size_t count : {0, 1, 2, 1000}) {
        std::vector<int> calls(count, 1);
        parallelFor(count, [&](size_t i) { ++calls[i]; });
        EXPECT_EQ(calls, std::vector<int>(count, 2));
    }
}

TEST(ParallelFor, CanBeNested) {
    std::vector<std::vector<size_t>> results(30, std::vector<size_t>(40));
    parallelFor(30, [&](size_t i) { parallelFor(40, [&](size_t k) { results[i][k] = 100 * i + k; }); });
    for (size_t i = 0; i < 30; ++i)
        for (size_t k = 0; k < 40; ++k)
            EXPECT_EQ(results[i][k], 100 * i + k);
}

TEST(ParallelFor, RethrowsExceptionsAfterAllIterationsHaveEnded) {
    std::vector<int> calls(100);
    const auto loop = [&] {
        parallelFor(calls.size(), [&](size_t i) {
            calls[i] = 1;
            if (i == 50)
                throw std::runtime_error("fifty");
        });
    };
    EXPECT_THROW(loop(), std::runtime_error);
    EXPECT_EQ(calls[50], 1);
    calls.assign(100, 0); // a data race if an iteration were still running
}

TEST(PerThread, EachThreadHasOneObject) {
    PerThread<size_t> counts;
    parallelFor(1000, [&](size_t) { ++counts.local([] { return std::make_unique<size_t>(0); }); });
    size_t sum = 0, objects = 0;
    counts.forEach([&](size_t count) {
        sum += count;
        ++objects;
    });
    EXPECT_EQ(sum, 1000u); // no thread shares its object
    EXPECT_LE(objects, arenaThreads());
}

} // namespace
} // namespace strobe
