#include "core/util/file_lock.h"

#include "core/util/error.h"

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace strobe {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& lockFile) {
    throw Error("cannot write " + lockFile.string() + ": " + std::strerror(errno), ErrorKind::Output);
}

/// Whether the name still belongs to the open file: its last holder may have removed it.
bool isSameFile(int fd, const fs::path& lockFile) {
    struct stat byDescriptor, byName;
    return fstat(fd, &byDescriptor) == 0 && stat(lockFile.c_str(), &byName) == 0 &&
           byDescriptor.st_dev == byName.st_dev && byDescriptor.st_ino == byName.st_ino;
}

std::string holderOf(int fd) {
    char text[300];
    const ssize_t length = pread(fd, text, sizeof text, 0);
    return length > 0 ? std::string(text, size_t(length)) : "another process";
}

std::string thisProcess() {
    char host[256] = "";
    gethostname(host, sizeof host - 1);
    return "process " + std::to_string(getpid()) + " on " + host;
}

} // namespace

FileLock::FileLock(const fs::path& file) : m_lockFile(file.string() + ".lock") {
    for (;;) {
        m_fd = open(m_lockFile.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
        if (m_fd < 0)
            fail(m_lockFile);
        if (flock(m_fd, LOCK_EX | LOCK_NB) != 0) {
            const bool isHeld = errno == EWOULDBLOCK;
            const std::string holder = holderOf(m_fd);
            close(std::exchange(m_fd, -1));
            if (!isHeld)
                return; // a file system without locks
            throw Error(file.string() + " is in use by " + holder, ErrorKind::Usage);
        }
        if (isSameFile(m_fd, m_lockFile))
            break;
        close(m_fd);
    }
    const std::string holder = thisProcess();
    if (ftruncate(m_fd, 0) != 0 || write(m_fd, holder.data(), holder.size()) < 0) // a full disk
        return;
}

FileLock::~FileLock() {
    if (m_fd < 0)
        return;
    unlink(m_lockFile.c_str());
    close(m_fd);
}

} // namespace strobe
