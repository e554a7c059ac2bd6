#include "core/util/resource_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <sys/stat.h>
#include <unistd.h>

#ifdef __linux__
#include <sys/sysinfo.h>
#endif

namespace strobe {
namespace {

namespace fs = std::filesystem;

/// Returns whether `file` is `root` or a file below it; both are canonical.
bool isWithin(const fs::path& root, const fs::path& file) {
    return std::mismatch(root.begin(), root.end(), file.begin(), file.end()).first == root.end();
}

/// Returns the memory of the machine in bytes, including swap.
uint64_t machineBytes() {
#ifdef __linux__
    struct sysinfo info;
    if (sysinfo(&info) == 0)
        return (uint64_t(info.totalram) + info.totalswap) * info.mem_unit;
#endif
    return std::numeric_limits<uint64_t>::max();
}

} // namespace

ResourcePolicy::ResourcePolicy(const Settings& settings) : m_settings(settings), m_isRecording(true) {
    for (fs::path& root : m_settings.roots) {
        std::error_code error;
        const fs::path real = fs::canonical(root, error);
        if (error)
            throw Error(fmt::format("--sandbox \"{}\": {}", root.string(), error.message()),
                        ErrorKind::Usage);
        root = real;
    }
}

fs::path ResourcePolicy::authorizeRead(const fs::path& file, const Location& where) const {
    if (!restrictsFiles()) {
        record(file);
        return file;
    }
    std::error_code error;
    fs::path real = fs::absolute(file, error);
    if (!error)
        real = fs::weakly_canonical(real, error);
    if (!error && std::any_of(m_settings.roots.begin(), m_settings.roots.end(),
                              [&](const fs::path& root) { return isWithin(root, real); })) {
        record(real);
        return real;
    }
    throw Error(
        where,
        fmt::format("cannot read file \"{}\": it is outside the files and directories given to --sandbox",
                    file.string()),
        where ? ErrorKind::Scene : ErrorKind::Usage);
}

void ResourcePolicy::record(const fs::path& file) const {
    if (!m_isRecording)
        return;
    const std::lock_guard lock(m_mutex);
    m_authorized.insert(file);
}

bool ResourcePolicy::hasAuthorized(const fs::path& file) const {
    struct stat requested;
    if (::stat(file.c_str(), &requested) != 0)
        return false;
    const std::lock_guard lock(m_mutex);
    return std::any_of(m_authorized.begin(), m_authorized.end(), [&](const fs::path& authorized) {
        struct stat status;
        return ::stat(authorized.c_str(), &status) == 0 && status.st_dev == requested.st_dev &&
               status.st_ino == requested.st_ino;
    });
}

void ResourcePolicy::requireMemory(uint64_t bytes, const std::string& item, const std::string& remedy,
                                   const Location& where) const {
    const bool hasLimit = m_settings.maxMemory != 0;
    const uint64_t used = residentBytes();
    const uint64_t limit = hasLimit ? m_settings.maxMemory : machineBytes();
    if (used < limit && bytes <= limit - used)
        return;
    throw Error(where,
                fmt::format("{} would take {} more, with {} in use: {} {}; {}", item, formatBytes(bytes),
                            formatBytes(used), hasLimit ? "--max-memory allows" : "this machine has",
                            formatBytes(limit), remedy));
}

const ResourcePolicy& resourcePolicyOf(const Location& where) {
    static const ResourcePolicy unrestricted;
    return where && where.source->policy ? *where.source->policy : unrestricted;
}

uint64_t residentBytes() {
    std::ifstream file("/proc/self/statm");
    uint64_t total = 0, resident = 0;
    file >> total >> resident;
    return file ? resident * uint64_t(sysconf(_SC_PAGESIZE)) : 0;
}

std::string formatBytes(uint64_t bytes) {
    if (bytes >= 1000000000)
        return fmt::format("{:.1f} GB", double(bytes) * 1e-9);
    return fmt::format("{:.1f} MB", double(bytes) * 1e-6);
}

} // namespace strobe
