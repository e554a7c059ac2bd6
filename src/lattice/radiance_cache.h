// A hash table of the radiance of shading points that all threads share without locks.
#pragma once

#include "core/math/math.h"

#include <atomic>
#include <cstdint>

namespace strobe {

/// Maps 64-bit keys, which are hashes and not 0, to radiance. The size is fixed: an entry that is stored into
/// a full bucket replaces another. A value must be a function of its key, so that losing an entry, or storing
/// it twice, costs time but does not change the image. An entry holds its key mixed with its value; an entry
/// that another thread is writing reads as absent (as in the lockless transposition tables of Hyatt & Mann,
/// 2002).
class RadianceCache {
  public:
    /// Allocates as many buckets as fit into `bytes`, at least one. Throws std::bad_alloc.
    explicit RadianceCache(size_t bytes);
    ~RadianceCache();
    RadianceCache(const RadianceCache&) = delete;
    RadianceCache& operator=(const RadianceCache&) = delete;

    /// Returns false and leaves `value` unchanged if there is no entry.
    bool find(uint64_t key, Rgb& value) const;
    /// Prefetches the memory that `find` and `store` read.
    void prefetch(uint64_t key) const { __builtin_prefetch(&bucketOf(key)); }

    enum class StoreResult {
        Inserted,
        Duplicate, ///< there was an entry for the key already
        Replaced,  ///< inserted in place of another entry
    };
    StoreResult store(uint64_t key, const Rgb& value);

    /// Removes all entries. Precondition: no other thread uses the cache.
    void clear();
    size_t bytes() const { return m_bucketCount * sizeof(Bucket); }

    /// The size of the cache per entry.
    static constexpr double bytesPerEntry() { return double(sizeof(Bucket)) / kWays; }

  private:
    static constexpr int kWays = 3;
    /// A cache line of the processor: one memory access per lookup.
    struct alignas(64) Bucket {
        std::atomic<uint64_t> check[kWays], redGreen[kWays];
        std::atomic<uint32_t> blue[kWays];
    };
    void allocate();
    Bucket& bucketOf(uint64_t key) const {
        return m_buckets[size_t((unsigned __int128)(key)*m_bucketCount >> 64)];
    }
    /// Returns the key of an entry; 0 if it is empty. The key of a half-written entry is random bits.
    static uint64_t read(const Bucket& bucket, int way, uint64_t& redGreen, uint32_t& blue);

    size_t m_bucketCount;
    Bucket* m_buckets;
};

} // namespace strobe
