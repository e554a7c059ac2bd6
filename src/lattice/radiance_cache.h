// A table of shaded blocks that all threads share without locks.
#pragma once

#include "core/math/math.h"

#include <atomic>
#include <cstdint>

namespace strobe {

/// Maps 64-bit keys (never 0) to radiance. Bounded: a full bucket gives up one of its blocks. A value must be
/// a function of its key alone: then losing one, or storing one twice, costs time and changes nothing.
/// Entries carry their key mixed with their value, so that one half-written by another thread reads as absent
/// (the trick of lockless transposition tables, Hyatt & Mann 2002).
class RadianceCache {
  public:
    /// Room for as many blocks as fit into `bytes`, at least one bucket.
    explicit RadianceCache(size_t bytes);
    ~RadianceCache();
    RadianceCache(const RadianceCache&) = delete;
    RadianceCache& operator=(const RadianceCache&) = delete;

    bool find(uint64_t key, Rgb& value) const;
    /// Asks the memory for what `find` will read.
    void prefetch(uint64_t key) const { __builtin_prefetch(&bucketOf(key)); }

    enum class Stored { Fresh, Duplicate, Evicting };
    /// Duplicate: the block was there already. Evicting: another block made room.
    Stored store(uint64_t key, const Rgb& value);

    /// Forgets all blocks. No other thread is at it.
    void clear();
    size_t bytes() const { return m_count * sizeof(Bucket); }

    /// What room for a block takes.
    static constexpr double bytesPerEntry() { return double(sizeof(Bucket)) / kWays; }

  private:
    void map();
    static constexpr int kWays = 3;
    /// A line of the processor's cache: what is looked up is one piece of memory.
    struct alignas(64) Bucket {
        std::atomic<uint64_t> check[kWays], redGreen[kWays];
        std::atomic<uint32_t> blue[kWays];
    };
    Bucket& bucketOf(uint64_t key) const { return m_buckets[size_t((unsigned __int128)(key)*m_count >> 64)]; }
    /// The key of an entry, 0 when it is empty or torn beyond recognition.
    static uint64_t read(const Bucket& bucket, int way, uint64_t& redGreen, uint32_t& blue);

    size_t m_count;
    Bucket* m_buckets;
};

} // namespace strobe
