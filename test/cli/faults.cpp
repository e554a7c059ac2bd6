// A library to preload (LD_PRELOAD): makes calls for files below $FAULTS_DIR fail, one in $FAULTS_EVERY,
// chosen by a hash of $FAULTS_SEED and the number of the call. Failures are those of disks and networks:
// ENOSPC, EIO, EINTR, EMFILE, EACCES, and partial reads and writes. If the seed is odd, ENOSPC persists. Logs
// to $FAULTS_LOG.
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

namespace {

template <class F>
F* next(const char* name) {
    return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}

const char* folder() { return std::getenv("FAULTS_DIR"); }
uint64_t number(const char* variable) {
    const char* text = std::getenv(variable);
    return text ? std::strtoull(text, nullptr, 10) : 0;
}

std::atomic<uint64_t> calls{0};
std::atomic<bool> full{false};
constexpr int kFiles = 4096;
std::atomic<bool> watched[kFiles]; ///< by file descriptor

/// Returns a hash of the seed and the number of calls so far.
uint64_t draw() {
    uint64_t h = number("FAULTS_SEED") * 0x9e3779b97f4a7c15u + calls.fetch_add(1) + 1;
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
    return h ^ (h >> 31);
}

bool isWatched(const char* path) {
    const char* directory = folder();
    if (!directory || !path)
        return false;
    char absolute[8192];
    if (path[0] != '/') {
        char current[4096];
        if (!getcwd(current, sizeof current))
            return false;
        std::snprintf(absolute, sizeof absolute, "%s/%s", current, path);
        path = absolute;
    }
    return std::strncmp(path, directory, std::strlen(directory)) == 0;
}
bool isWatched(int fd) { return fd >= 0 && fd < kFiles && watched[fd]; }

void writeLog(const char* text) {
    const char* file = std::getenv("FAULTS_LOG");
    const int fd =
        file ? next<int(const char*, int, ...)>("open")(file, O_WRONLY | O_CREAT | O_APPEND, 0666) : -1;
    if (fd < 0)
        return;
    char line[64];
    const int n = std::snprintf(line, sizeof line, "%s\n", text);
    (void)!next<ssize_t(int, const void*, size_t)>("write")(fd, line, size_t(n));
    next<int(int)>("close")(fd);
}

/// Returns whether this call fails; then sets errno to one of the errors.
bool fails(const char* call, std::initializer_list<int> errors) {
    const uint64_t every = number("FAULTS_EVERY"), h = draw();
    bool isFailing = every > 0 && h % every == 0;
    int error = errors.begin()[(h >> 32) % errors.size()];
    for (const int possible : errors)
        if (possible == ENOSPC && full) {
            isFailing = true;
            error = ENOSPC;
        }
    if (!isFailing)
        return false;
    if (error == ENOSPC && number("FAULTS_SEED") % 2 == 1)
        full = true;
    char text[64];
    std::snprintf(text, sizeof text, "%s: %s", call, std::strerror(error));
    writeLog(text);
    errno = error;
    return true;
}

/// Returns the number of bytes to write or read in this call.
size_t fewer(const char* call, size_t size) {
    const uint64_t every = number("FAULTS_EVERY"), h = draw();
    if (size < 2 || every == 0 || h % every != 0)
        return size;
    writeLog(call);
    return 1 + (h >> 32) % (size - 1);
}

int watchedFile(int fd, bool is) {
    if (fd >= 0 && fd < kFiles)
        watched[fd] = is;
    return fd;
}

int opened(const char* name, const char* path, int flags, mode_t mode) {
    const bool is = isWatched(path);
    const bool makes = (flags & O_CREAT) != 0;
    if (is &&
        (makes ? fails("open", {ENOSPC, EIO, EINTR, EMFILE, EACCES}) : fails("open", {EIO, EINTR, EMFILE})))
        return -1;
    return watchedFile(next<int(const char*, int, ...)>(name)(path, flags, mode), is);
}

mode_t modeOf(int flags, va_list list) { return flags & O_CREAT ? mode_t(va_arg(list, int)) : 0; }

} // namespace

extern "C" {

int open(const char* path, int flags, ...) {
    va_list list;
    va_start(list, flags);
    const mode_t mode = modeOf(flags, list);
    va_end(list);
    return opened("open", path, flags, mode);
}
int open64(const char* path, int flags, ...) {
    va_list list;
    va_start(list, flags);
    const mode_t mode = modeOf(flags, list);
    va_end(list);
    return opened("open64", path, flags, mode);
}
FILE* fopen(const char* path, const char* mode) {
    if (isWatched(path) && fails("fopen", {EIO, EMFILE}))
        return nullptr;
    return next<FILE*(const char*, const char*)>("fopen")(path, mode);
}
FILE* fopen64(const char* path, const char* mode) {
    if (isWatched(path) && fails("fopen", {EIO, EMFILE}))
        return nullptr;
    return next<FILE*(const char*, const char*)>("fopen64")(path, mode);
}
ssize_t write(int fd, const void* bytes, size_t size) {
    if (isWatched(fd)) {
        if (fails("write", {ENOSPC, EIO, EINTR}))
            return -1;
        size = fewer("write: some", size);
    }
    return next<ssize_t(int, const void*, size_t)>("write")(fd, bytes, size);
}
ssize_t read(int fd, void* bytes, size_t size) {
    if (isWatched(fd)) {
        if (fails("read", {EIO, EINTR}))
            return -1;
        size = fewer("read: some", size);
    }
    return next<ssize_t(int, void*, size_t)>("read")(fd, bytes, size);
}
int fsync(int fd) {
    if (isWatched(fd) && fails("fsync", {ENOSPC, EIO, EINTR}))
        return -1;
    return next<int(int)>("fsync")(fd);
}
int close(int fd) {
    const bool is = isWatched(fd);
    watchedFile(fd, false);
    const int result = next<int(int)>("close")(fd);
    return is && fails("close", {ENOSPC, EIO, EINTR}) ? -1 : result; // the descriptor is closed even so
}
int rename(const char* from, const char* to) {
    if (isWatched(to) && fails("rename", {ENOSPC, EIO, EINTR, EACCES}))
        return -1;
    return next<int(const char*, const char*)>("rename")(from, to);
}

} // extern "C"
