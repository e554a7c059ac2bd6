// RadianceCache and IndexTable.
#include "core/math/hash.h"
#include "core/util/index_table.h"
#include "lattice/radiance_cache.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <unordered_map>

namespace strobe {
namespace {

using StoreResult = RadianceCache::StoreResult;

uint64_t keyOf(uint64_t i) { return hashOf(17, i) | 1; }

/// Returns a value all of whose bits depend on the key.
Rgb valueOf(uint64_t key) {
    const uint64_t a = mix64(key), b = mix64(a);
    return {unitFloat(uint32_t(a)), unitFloat(uint32_t(a >> 32)), unitFloat(uint32_t(b))};
}

TEST(RadianceCache, FindsStoredValues) {
    RadianceCache cache(1 << 20);
    Rgb value(-1);
    for (uint64_t i = 0; i < 1000; ++i) {
        EXPECT_FALSE(cache.find(keyOf(i), value));
        EXPECT_EQ(value, Rgb(-1)); // unchanged
        EXPECT_EQ(cache.store(keyOf(i), valueOf(keyOf(i))), StoreResult::Inserted);
        EXPECT_EQ(cache.store(keyOf(i), valueOf(keyOf(i))), StoreResult::Duplicate);
    }
    for (uint64_t i = 0; i < 1000; ++i) {
        ASSERT_TRUE(cache.find(keyOf(i), value)) << i;
        EXPECT_EQ(value, valueOf(keyOf(i)));
    }
    EXPECT_FALSE(cache.find(keyOf(1000), value));
}

TEST(RadianceCache, StoresAnyRadiance) {
    RadianceCache cache(1 << 16);
    const Rgb values[] = {Rgb(0), Rgb(0, 0, 1), Rgb(1, 0, 0), Rgb(1e30f, 1e-40f, kInfinity), Rgb(-0.f, 2, 2)};
    for (uint64_t i = 0; i < std::size(values); ++i)
        EXPECT_EQ(cache.store(keyOf(i), values[i]), StoreResult::Inserted);
    for (uint64_t i = 0; i < std::size(values); ++i) {
        Rgb value(7);
        ASSERT_TRUE(cache.find(keyOf(i), value)) << i;
        EXPECT_EQ(value, values[i]);
    }
}

TEST(RadianceCache, OfZeroBytesHasOneBucketWhoseEntriesAreReplaced) {
    RadianceCache cache(0);
    EXPECT_GT(cache.bytes(), 0u);
    uint64_t capacity = 0;
    while (cache.store(keyOf(capacity), valueOf(keyOf(capacity))) == StoreResult::Inserted)
        ASSERT_LT(++capacity, 100u);
    EXPECT_GE(capacity, 1u);
    // The last entry replaced one already; each further entry replaces another.
    for (uint64_t last = capacity; last < capacity + 100; ++last) {
        if (last > capacity) {
            EXPECT_EQ(cache.store(keyOf(last), valueOf(keyOf(last))), StoreResult::Replaced);
        }
        uint64_t found = 0;
        for (uint64_t i = 0; i <= last; ++i)
            if (Rgb value; cache.find(keyOf(i), value)) {
                EXPECT_EQ(value, valueOf(keyOf(i)));
                ++found;
            }
        EXPECT_EQ(found, capacity);
        Rgb value;
        EXPECT_TRUE(cache.find(keyOf(last), value));
    }
}

/// Four threads store and find `keyCount` different keys for a while. All values found must be right.
void storeAndFindConcurrently(RadianceCache& cache, uint64_t keyCount, std::chrono::milliseconds time) {
    std::atomic<uint64_t> wrongCount{0}, foundCount{0}, lookupCount{0};
    std::atomic<bool> stop{false};
    std::vector<std::thread> threads;
    for (uint64_t t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            uint64_t wrong = 0, found = 0, lookups = 0;
            for (; !stop.load(std::memory_order_relaxed); ++lookups) {
                const uint64_t key = keyOf(hashOf(t, lookups) % keyCount);
                Rgb value;
                if (!cache.find(key, value)) {
                    cache.store(key, valueOf(key));
                    continue;
                }
                ++found;
                wrong += value != valueOf(key);
            }
            wrongCount += wrong;
            foundCount += found;
            lookupCount += lookups;
        });
    std::this_thread::sleep_for(time);
    stop = true;
    for (std::thread& thread : threads)
        thread.join();
    EXPECT_EQ(wrongCount, 0u) << "of " << foundCount;
    EXPECT_GT(foundCount, 1000u);
    EXPECT_GT(lookupCount - foundCount, 1000u); // as many entries were stored meanwhile
}

TEST(RadianceCache, ConcurrentStoresNeverGiveWrongValues) {
    RadianceCache oneBucket(0), small(1 << 14);
    storeAndFindConcurrently(oneBucket, 16, std::chrono::milliseconds(700));
    storeAndFindConcurrently(small, 4000, std::chrono::milliseconds(700));
}

TEST(IndexTable, BehavesLikeAMap) {
    IndexTable table;
    uint64_t inserted = 0, found = 0;
    for (uint64_t round = 0; round < 400; ++round) {
        table.clear();
        std::unordered_map<uint64_t, uint32_t> reference;
        // All sizes. In every other round the keys have equal low bits, which give the slot.
        const uint64_t count = hashOf(round, 1) % (uint64_t(16) << round % 10);
        const int shift = round % 2 ? 0 : 40;
        for (uint64_t i = 0; i < count; ++i) {
            const uint64_t key = (hashOf(round, 2, i) % (count / 2 + 1) + 1) << shift;
            const uint32_t next = uint32_t(reference.size());
            const auto [entry, isNew] = reference.try_emplace(key, next);
            ASSERT_EQ(table.findOrInsert(key, next), entry->second) << round << ' ' << i;
            ++(isNew ? inserted : found);
        }
    }
    EXPECT_GT(inserted, 100000u);
    EXPECT_GT(found, 100000u);
}

TEST(IndexTable, ClearRemovesAllKeys) {
    IndexTable table;
    for (uint32_t round = 0; round < 1000; ++round) {
        table.clear();
        for (uint64_t key = 1; key <= 40; ++key)
            ASSERT_EQ(table.findOrInsert(key, round), round);
    }
}

} // namespace
} // namespace strobe
