#include "core/image/texel_memory.h"

#include "core/util/error.h"
#include "core/util/resource_policy.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/mman.h>
#include <unistd.h>

namespace strobe {
namespace {

/// Not /tmp, which is in memory on some systems.
std::string temporaryFolder() {
    const char* folder = std::getenv("TMPDIR");
    std::error_code ignored;
    if (folder && *folder)
        return folder;
    return std::filesystem::is_directory("/var/tmp", ignored) ? "/var/tmp" : "/tmp";
}

[[noreturn]] void failFile(const std::string& item, size_t bytes, int error) {
    throw Error(item + ": cannot keep " + formatBytes(bytes) + " in a temporary file in " +
                    temporaryFolder() + ": " + std::strerror(error) +
                    "; raise --texture-mb, or set TMPDIR to another folder",
                ErrorKind::Output);
}

/// A file descriptor that is closed at the end of its scope.
struct File {
    int descriptor;
    ~File() {
        if (descriptor >= 0)
            ::close(descriptor);
    }
};

/// Returns the descriptor of a new file without a name.
int temporaryFile() {
    std::string name = temporaryFolder() + "/strobe-textures-XXXXXX";
    const int descriptor = ::mkostemp(name.data(), O_CLOEXEC);
    if (descriptor >= 0)
        ::unlink(name.c_str());
    return descriptor;
}

} // namespace

TexelMemory::TexelMemory(size_t bytes) : m_bytes(bytes), m_heap(new std::byte[bytes]) {
    m_data = m_heap.get();
}

TexelMemory::TexelMemory(size_t bytes, TexelPager& pager, const std::string& item)
    : m_bytes(bytes), m_states(new std::atomic<uint8_t>[(bytes + kPageBytes - 1) / kPageBytes]()) {
    const File file{temporaryFile()};
    if (file.descriptor < 0)
        failFile(item, bytes, errno);
    // Reserves the space: a write to a mapping without space would end the program.
    if (const int error = ::posix_fallocate(file.descriptor, 0, off_t(bytes)))
        failFile(item, bytes, error);
    m_mapping =
        ::mmap(nullptr, bytes + kPageBytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (m_mapping == MAP_FAILED)
        failFile(item, bytes, errno);
    const size_t misaligned = reinterpret_cast<uintptr_t>(m_mapping) % kPageBytes;
    void* aligned = static_cast<std::byte*>(m_mapping) + (kPageBytes - misaligned) % kPageBytes;
    if (::mmap(aligned, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_FIXED, file.descriptor, 0) ==
        MAP_FAILED) {
        const int error = errno;
        ::munmap(m_mapping, bytes + kPageBytes);
        failFile(item, bytes, error);
    }
    m_data = static_cast<std::byte*>(aligned);
    m_pager = &pager;
    pager.add(*this);
}

TexelMemory::~TexelMemory() {
    if (!m_pager)
        return;
    m_pager->remove(*this);
    ::munmap(m_mapping, m_bytes + kPageBytes);
}

void TexelMemory::enter(std::atomic<uint8_t>& state) const {
    const uint8_t before = state.exchange(kRecent | kWasResident, std::memory_order_relaxed);
    if ((before & kRecency) == kAbsent)
        m_pager->count(before & kWasResident);
}

void TexelMemory::dropPages(size_t first, size_t count) {
    const size_t begin = first * kPageBytes;
    ::madvise(m_data + begin, std::min(count * kPageBytes, m_bytes - begin), MADV_DONTNEED);
}

void TexelMemory::dropAll() { dropPages(0, pages()); }

PageCounts TexelPager::counts() const {
    const std::lock_guard lock(m_mutex);
    return {m_bytesInFiles, m_read.load(std::memory_order_relaxed),
            m_readAgain.load(std::memory_order_relaxed)};
}

void TexelPager::add(TexelMemory& memory) {
    const std::lock_guard lock(m_mutex);
    m_memories.push_back(&memory);
    m_bytesInFiles += memory.size();
}

void TexelPager::remove(TexelMemory& memory) {
    const std::lock_guard lock(m_mutex);
    std::erase(m_memories, &memory);
    m_handMemory = m_handPage = 0;
    for (size_t page = 0; page < memory.pages(); ++page)
        if (memory.m_states[page].load(std::memory_order_relaxed) & TexelMemory::kRecency)
            m_resident.fetch_sub(TexelMemory::kPageBytes, std::memory_order_relaxed);
}

void TexelPager::count(bool isReadAgain) {
    m_read.fetch_add(TexelMemory::kPageBytes, std::memory_order_relaxed);
    if (isReadAgain)
        m_readAgain.fetch_add(TexelMemory::kPageBytes, std::memory_order_relaxed);
    if (m_resident.fetch_add(TexelMemory::kPageBytes, std::memory_order_relaxed) >
        m_limit.load(std::memory_order_relaxed))
        drop();
}

void TexelPager::drop() {
    const std::unique_lock lock(m_mutex, std::try_to_lock);
    if (!lock) // another thread drops pages
        return;
    const uint64_t limit = m_limit.load(std::memory_order_relaxed);
    const uint64_t target = limit - limit / 8;
    size_t left = 0; // two rounds at most
    for (const TexelMemory* memory : m_memories)
        left += 2 * memory->pages();
    for (; left > 0 && m_resident.load(std::memory_order_relaxed) > target; --left) {
        if (m_handPage >= m_memories[m_handMemory]->pages()) {
            m_handPage = 0;
            m_handMemory = (m_handMemory + 1) % m_memories.size();
        }
        TexelMemory& memory = *m_memories[m_handMemory];
        std::atomic<uint8_t>& state = memory.m_states[m_handPage];
        uint8_t before = state.load(std::memory_order_relaxed);
        const uint8_t recency = before & TexelMemory::kRecency;
        if (recency != TexelMemory::kAbsent &&
            state.compare_exchange_strong(before, uint8_t(before - 1), std::memory_order_relaxed) &&
            recency == TexelMemory::kAged) {
            memory.dropPages(m_handPage, 1);
            m_resident.fetch_sub(TexelMemory::kPageBytes, std::memory_order_relaxed);
        }
        ++m_handPage;
    }
}

} // namespace strobe
