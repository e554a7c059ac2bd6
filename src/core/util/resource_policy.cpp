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

bool isWithin(const fs::path& root, const fs::path& file) {
    return std::mismatch(root.begin(), root.end(), file.begin(), file.end()).first == root.end();
}

/// Memory that the machine has at all, on its disks, too.
uint64_t machineBytes() {
#ifdef __linux__
    struct sysinfo info;
    if (sysinfo(&info) == 0)
        return (uint64_t(info.totalram) + info.totalswap) * info.mem_unit;
#endif
    return std::numeric_limits<uint64_t>::max();
}

} // namespace

ResourcePolicy::ResourcePolicy(const Settings& settings) : m_settings(settings), m_remembers(true) {
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
        remember(file);
        return file;
    }
    std::error_code error;
    fs::path real = fs::absolute(file, error);
    if (!error)
        real = fs::weakly_canonical(real, error);
    if (!error && std::any_of(m_settings.roots.begin(), m_settings.roots.end(),
                              [&](const fs::path& root) { return isWithin(root, real); })) {
        remember(real);
        return real;
    }
    throw Error(
        where,
        fmt::format("file \"{}\" must not be read: it is outside of what --sandbox allows", file.string()),
        where ? ErrorKind::Scene : ErrorKind::Usage);
}

void ResourcePolicy::remember(const fs::path& file) const {
    if (!m_remembers)
        return;
    const std::lock_guard lock(m_mutex);
    m_admitted.insert(file);
}

bool ResourcePolicy::hasAuthorized(const fs::path& file) const {
    struct stat wanted, one;
    if (::stat(file.c_str(), &wanted) != 0)
        return false;
    const std::lock_guard lock(m_mutex);
    return std::any_of(m_admitted.begin(), m_admitted.end(), [&](const fs::path& admitted) {
        return ::stat(admitted.c_str(), &one) == 0 && one.st_dev == wanted.st_dev &&
               one.st_ino == wanted.st_ino;
    });
}

void ResourcePolicy::requireMemory(uint64_t bytes, const std::string& what, const std::string& remedy,
                                   const Location& where) const {
    const bool isAsked = m_settings.maxMemory != 0;
    const uint64_t held = residentBytes(), most = isAsked ? m_settings.maxMemory : machineBytes();
    if (held < most && bytes <= most - held)
        return;
    throw Error(where,
                fmt::format("{} would take {} more, with {} in use: {} {}; {}", what, formatBytes(bytes),
                            formatBytes(held), isAsked ? "--max-memory allows" : "this machine has",
                            formatBytes(most), remedy));
}

const ResourcePolicy& resourcePolicyOf(const Location& where) {
    static const ResourcePolicy all;
    return where && where.source->policy ? *where.source->policy : all;
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
