#include "core/util/parallel.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace strobe {
namespace {

// With ThreadSanitizer, this also holds that it knows the order of what is before, in and after a loop.
TEST(ParallelFor, takesEveryTurnOnce) {
    for (const size_t count : {0, 1, 2, 1000}) {
        std::vector<int> turns(count, 1);
        parallelFor(count, [&](size_t i) { ++turns[i]; });
        EXPECT_EQ(turns, std::vector<int>(count, 2));
    }
}

TEST(ParallelFor, nests) {
    std::vector<std::vector<size_t>> turns(30, std::vector<size_t>(40));
    parallelFor(30, [&](size_t i) { parallelFor(40, [&](size_t k) { turns[i][k] = 100 * i + k; }); });
    for (size_t i = 0; i < 30; ++i)
        for (size_t k = 0; k < 40; ++k)
            EXPECT_EQ(turns[i][k], 100 * i + k);
}

TEST(ParallelFor, passesAnExceptionOn) {
    std::vector<int> turns(100);
    const auto loop = [&] {
        parallelFor(turns.size(), [&](size_t i) {
            turns[i] = 1;
            if (i == 50)
                throw std::runtime_error("fifty");
        });
    };
    EXPECT_THROW(loop(), std::runtime_error);
    EXPECT_EQ(turns[50], 1);
    turns.assign(100, 0); // nobody is at it any longer
}

} // namespace
} // namespace strobe
