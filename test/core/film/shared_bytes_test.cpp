#include "core/film/shared_bytes.h"
#include "core/util/memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

namespace strobe {
namespace {

TEST(SharedBytes, HaveTheBytesOfAString) {
    const SharedBytes bytes(std::string("some bytes"));
    const SharedBytes copy = bytes;
    EXPECT_EQ(copy.view(), "some bytes");
    EXPECT_EQ(copy.size(), 10u);
    EXPECT_EQ(copy.view().data(), bytes.view().data());
    EXPECT_EQ(SharedBytes().view(), "");
}

/// Sizes of parts of blocks, of the largest block and of more.
TEST(ByteArena, BytesLiveAsLongAsTheirOwners) {
    constexpr size_t kSizes[] = {100, 1 << 16, 3, 1 << 20, 5 << 20, 1, 4 << 20, 0, 2 << 20};
    std::vector<SharedBytes> all;
    {
        ByteArena arena;
        for (const size_t size : kSizes) {
            const std::shared_ptr<char> bytes = arena.allocate(size);
            std::fill_n(bytes.get(), size, char('a' + all.size()));
            all.emplace_back(bytes, size);
        }
    }
    for (size_t i = 0; i < all.size(); ++i) {
        EXPECT_EQ(all[i].size(), kSizes[i]);
        EXPECT_EQ(all[i].view().find_first_not_of(char('a' + i)), std::string_view::npos) << i;
    }
}

TEST(ByteArena, CopiesOfItemsAreAligned) {
    ByteArena arena;
    arena.allocate(1);
    std::vector<__int128> numbers(1000);
    std::iota(numbers.begin(), numbers.end(), __int128(1) << 80);
    const SharedItems<__int128> copy = arena.copy(numbers);
    arena.release();
    EXPECT_EQ(reinterpret_cast<uintptr_t>(copy.items.data()) % alignof(__int128), 0u);
    EXPECT_TRUE(std::equal(numbers.begin(), numbers.end(), copy.items.begin(), copy.items.end()));
    EXPECT_TRUE(arena.copy(std::vector<int>()).items.empty());
}

TEST(HugeBuffer, KeepsItsNumbersWhileItGrows) {
    HugeBuffer<int> numbers(1);
    numbers[0] = 7;
    numbers.resize(1'000'000);
    numbers.push_back(8);
    EXPECT_EQ(numbers.front(), 7);
    EXPECT_EQ(numbers.back(), 8);
}

TEST(HugeVector, KeepsItsNumbersWhileItGrows) {
    HugeVector<int> numbers;
    for (int i = 0; i < 2'000'000; ++i)
        numbers.push_back(i);
    numbers.shrink_to_fit();
    HugeVector<int> expected(numbers.size());
    std::iota(expected.begin(), expected.end(), 0);
    EXPECT_EQ(numbers, expected);
}

TEST(HugePages, AreAligned) {
    constexpr size_t kBytes = (5 << 20) + 1;
    for (int i = 0; i < 10; ++i) {
        char* const pages = static_cast<char*>(allocateHugePages(kBytes));
        EXPECT_EQ(reinterpret_cast<uintptr_t>(pages) % (2 << 20), 0u);
        pages[0] = pages[kBytes - 1] = 1;
        freeHugePages(pages, kBytes);
    }
}

} // namespace
} // namespace strobe
