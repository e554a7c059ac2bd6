// The tables that shared shades are kept in: the cache of all threads, and the index of one batch.
#include "core/math/hash.h"
#include "lattice/index_table.h"
#include "lattice/radiance_cache.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <unordered_map>

namespace strobe {
namespace {

using Stored = RadianceCache::Stored;

uint64_t keyOf(uint64_t i) { return hashOf(17, i) | 1; }

/// A block's value is a function of its key; all of its bits are.
Rgb valueOf(uint64_t key) {
    const uint64_t a = mix64(key), b = mix64(a);
    return {unitFloat(uint32_t(a)), unitFloat(uint32_t(a >> 32)), unitFloat(uint32_t(b))};
}

TEST(RadianceCache, FindsWhatWasStored) {
    RadianceCache cache(1 << 20);
    Rgb value(-1);
    for (uint64_t i = 0; i < 1000; ++i) {
        EXPECT_FALSE(cache.find(keyOf(i), value));
        EXPECT_EQ(value, Rgb(-1)); // left alone
        EXPECT_EQ(cache.store(keyOf(i), valueOf(keyOf(i))), Stored::Fresh);
        EXPECT_EQ(cache.store(keyOf(i), valueOf(keyOf(i))), Stored::Duplicate);
    }
    for (uint64_t i = 0; i < 1000; ++i) {
        ASSERT_TRUE(cache.find(keyOf(i), value)) << i;
        EXPECT_EQ(value, valueOf(keyOf(i)));
    }
    EXPECT_FALSE(cache.find(keyOf(1000), value));
}

TEST(RadianceCache, KeepsAnyRadiance) {
    RadianceCache cache(1 << 16);
    const Rgb values[] = {Rgb(0), Rgb(0, 0, 1), Rgb(1, 0, 0), Rgb(1e30f, 1e-40f, kInfinity), Rgb(-0.f, 2, 2)};
    for (uint64_t i = 0; i < std::size(values); ++i)
        EXPECT_EQ(cache.store(keyOf(i), values[i]), Stored::Fresh);
    for (uint64_t i = 0; i < std::size(values); ++i) {
        Rgb value(7);
        ASSERT_TRUE(cache.find(keyOf(i), value)) << i;
        EXPECT_EQ(value, values[i]);
    }
}

TEST(RadianceCache, WithoutMemoryHasOneBucketWhoseBlocksMakeRoom) {
    RadianceCache cache(0);
    EXPECT_GT(cache.bytes(), 0u);
    uint64_t fresh = 0;
    while (cache.store(keyOf(fresh), valueOf(keyOf(fresh))) == Stored::Fresh)
        ASSERT_LT(++fresh, 100u);
    EXPECT_GE(fresh, 1u);
    // One block has gone for the new one; each further one costs another.
    for (uint64_t last = fresh; last < fresh + 100; ++last) {
        if (last > fresh) {
            EXPECT_EQ(cache.store(keyOf(last), valueOf(keyOf(last))), Stored::Evicting);
        }
        uint64_t held = 0;
        for (uint64_t i = 0; i <= last; ++i)
            if (Rgb value; cache.find(keyOf(i), value)) {
                EXPECT_EQ(value, valueOf(keyOf(i)));
                ++held;
            }
        EXPECT_EQ(held, fresh);
        Rgb value;
        EXPECT_TRUE(cache.find(keyOf(last), value));
    }
}

/// Float4 threads store and look up `keys` different blocks for a while.
void hammer(RadianceCache& cache, uint64_t keys, std::chrono::milliseconds time) {
    std::atomic<uint64_t> wrong{0}, found{0}, lookups{0};
    std::atomic<bool> stop{false};
    std::vector<std::thread> threads;
    for (uint64_t t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            uint64_t myWrong = 0, myFound = 0, i = 0;
            for (; !stop.load(std::memory_order_relaxed); ++i) {
                const uint64_t key = keyOf(hashOf(t, i) % keys);
                Rgb value;
                if (!cache.find(key, value)) {
                    cache.store(key, valueOf(key));
                    continue;
                }
                ++myFound;
                myWrong += value != valueOf(key);
            }
            wrong += myWrong, found += myFound, lookups += i;
        });
    std::this_thread::sleep_for(time);
    stop = true;
    for (std::thread& thread : threads)
        thread.join();
    EXPECT_EQ(wrong, 0u) << "of " << found;
    EXPECT_GT(found, 1000u);
    EXPECT_GT(lookups - found, 1000u); // and as many blocks changed under the readers' eyes
}

TEST(RadianceCache, ThreadsNeverSeeAWrongValue) {
    RadianceCache tiny(0), small(1 << 14);
    hammer(tiny, 16, std::chrono::milliseconds(700));
    hammer(small, 4000, std::chrono::milliseconds(700));
}

TEST(IndexTable, IsAMap) {
    IndexTable table;
    uint64_t inserted = 0, known = 0;
    for (uint64_t round = 0; round < 400; ++round) {
        table.clear();
        std::unordered_map<uint64_t, uint32_t> reference;
        // Batches of all sizes; every other one has keys that share their low bits, which say where they
        // belong.
        const uint64_t count = hashOf(round, 1) % (uint64_t(16) << round % 10);
        const int shift = round % 2 ? 0 : 40;
        for (uint64_t i = 0; i < count; ++i) {
            const uint64_t key = (hashOf(round, 2, i) % (count / 2 + 1) + 1) << shift;
            const uint32_t next = uint32_t(reference.size());
            const auto [at, isNew] = reference.try_emplace(key, next);
            ASSERT_EQ(table.insert(key, next), at->second) << round << ' ' << i;
            ++(isNew ? inserted : known);
        }
    }
    EXPECT_GT(inserted, 100000u);
    EXPECT_GT(known, 100000u);
}

TEST(IndexTable, ForgetsAllWhenCleared) {
    IndexTable table;
    for (uint32_t round = 0; round < 1000; ++round) {
        table.clear();
        for (uint64_t key = 1; key <= 40; ++key)
            ASSERT_EQ(table.insert(key, round), round);
    }
}

} // namespace
} // namespace strobe
