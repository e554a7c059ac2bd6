#include "lattice/radiance_cache.h"

#include "core/util/memory.h"

#include <algorithm>
#include <bit>
#include <new>

#include <sys/mman.h>

namespace strobe {

namespace {

uint64_t signature(uint64_t redGreen, uint32_t blue) { return redGreen ^ std::rotl(uint64_t(blue), 23); }

} // namespace

RadianceCache::~RadianceCache() {
    if (m_buckets)
        munmap(m_buckets, bytes());
}

RadianceCache::RadianceCache(size_t bytes) : m_count(std::max(bytes / sizeof(Bucket), size_t(1))) { map(); }

void RadianceCache::clear() {
    munmap(m_buckets, bytes());
    map();
}

void RadianceCache::map() {
    // Fresh pages are zero, and all-zero bytes are empty entries. They cost memory only once they are used;
    // large pages keep the address translation from costing more than the lookup.
    static_assert(std::atomic<uint64_t>::is_always_lock_free && sizeof(Bucket) == 64);
    m_buckets = nullptr;
    void* p = mmap(nullptr, bytes(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (p == MAP_FAILED)
        throw std::bad_alloc();
    m_buckets = static_cast<Bucket*>(p);
    adviseHugePages(p, bytes());
}

uint64_t RadianceCache::read(const Bucket& bucket, int way, uint64_t& redGreen, uint32_t& blue) {
    const uint64_t check = bucket.check[way].load(std::memory_order_relaxed);
    redGreen = bucket.redGreen[way].load(std::memory_order_relaxed);
    blue = bucket.blue[way].load(std::memory_order_relaxed);
    return check ^ signature(redGreen, blue);
}

bool RadianceCache::find(uint64_t key, Rgb& value) const {
    const Bucket& bucket = bucketOf(key);
    for (int way = 0; way < kWays; ++way) {
        uint64_t redGreen;
        uint32_t blue;
        if (read(bucket, way, redGreen, blue) != key)
            continue;
        value = Rgb(std::bit_cast<float>(uint32_t(redGreen)), std::bit_cast<float>(uint32_t(redGreen >> 32)),
                    std::bit_cast<float>(blue));
        return true;
    }
    return false;
}

RadianceCache::Stored RadianceCache::store(uint64_t key, const Rgb& value) {
    Bucket& bucket = bucketOf(key);
    int place = -1;
    for (int way = 0; way < kWays; ++way) {
        uint64_t redGreen;
        uint32_t blue;
        const uint64_t found = read(bucket, way, redGreen, blue);
        if (found == key)
            return Stored::Duplicate;
        if (found == 0 && place < 0)
            place = way;
    }
    const Stored result = place >= 0 ? Stored::Fresh : Stored::Evicting;
    if (place < 0)
        place = int(key % kWays);
    const uint64_t redGreen = std::bit_cast<uint32_t>(value.x) | uint64_t(std::bit_cast<uint32_t>(value.y))
                                                                     << 32;
    const uint32_t blue = std::bit_cast<uint32_t>(value.z);
    bucket.check[place].store(key ^ signature(redGreen, blue), std::memory_order_relaxed);
    bucket.redGreen[place].store(redGreen, std::memory_order_relaxed);
    bucket.blue[place].store(blue, std::memory_order_relaxed);
    return result;
}

} // namespace strobe
