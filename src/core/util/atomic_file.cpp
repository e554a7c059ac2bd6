#include "core/util/atomic_file.h"

#include "core/util/error.h"
#include "core/util/standard_files.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <unistd.h>
#include <utility>

namespace strobe {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& reason) {
    throw Error("cannot write " + path.string() + ": " + reason, ErrorKind::Output);
}

/// Calls `f` until it returns without being interrupted by a signal, and returns its result.
template <class F>
auto uninterrupted(const F& f) {
    for (;;)
        if (const auto result = f(); result >= 0 || errno != EINTR)
            return result;
}

/// Flushes a directory to disk, which makes a rename in it durable. Errors are ignored: some file systems do
/// not support it, and the file is complete.
void flushDirectory(const fs::path& directory) {
    const char* name = directory.empty() ? "." : directory.c_str();
    const int fd = uninterrupted([&] { return ::open(name, O_RDONLY | O_DIRECTORY | O_CLOEXEC); });
    if (fd < 0)
        return;
    uninterrupted([&] { return ::fsync(fd); });
    ::close(fd);
}

/// Writes all bytes to a file descriptor. `path` names it in errors.
void writeAll(int fd, const fs::path& path, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t n = ::write(fd, bytes.data(), bytes.size());
        if (n == 0 || (n < 0 && errno != EINTR))
            fail(path, n == 0 ? "the file system accepts no more data" : std::strerror(errno));
        bytes.remove_prefix(n > 0 ? size_t(n) : 0);
    }
}

/// A new file, which the destructor removes unless it was renamed.
class TemporaryFile {
  public:
    explicit TemporaryFile(const fs::path& final) : m_final(final) {
        for (int attempt = 0; m_fd < 0; ++attempt) {
            m_path =
                final.parent_path() / ("." + final.filename().string() + "." + std::to_string(::getpid()) +
                                       "-" + std::to_string(attempt) + ".tmp");
            m_fd = ::open(m_path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
            if (m_fd < 0 && errno != EINTR && (errno != EEXIST || attempt == 1000))
                fail(m_final, std::strerror(errno));
        }
    }
    ~TemporaryFile() {
        if (m_fd >= 0)
            ::close(m_fd);
        if (!m_renamed)
            ::unlink(m_path.c_str());
    }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    void write(std::string_view bytes) { writeAll(m_fd, m_final, bytes); }
    /// Flushes the file and renames it to its final name.
    void rename() {
        if (uninterrupted([&] { return ::fsync(m_fd); }) != 0)
            fail(m_final, std::strerror(errno));
        const int fd = std::exchange(m_fd, -1);
        if (::close(fd) != 0 && errno != EINTR) // close releases the descriptor even if interrupted
            fail(m_final, std::strerror(errno));
        if (uninterrupted([&] { return ::rename(m_path.c_str(), m_final.c_str()); }) != 0)
            fail(m_final, std::strerror(errno));
        m_renamed = true;
        flushDirectory(m_final.parent_path());
    }

  private:
    fs::path m_final, m_path;
    int m_fd = -1;
    bool m_renamed = false;
};

/// Follows symbolic links, and returns the file to write. Throws Error if it cannot be a regular file.
fs::path targetOf(const fs::path& path) {
    constexpr int kMaxLinks = 40; // as in Linux
    std::error_code error;
    fs::path target = path;
    for (int i = 0; fs::is_symlink(fs::symlink_status(target, error)); ++i) {
        if (i == kMaxLinks)
            fail(path, std::strerror(ELOOP));
        target = target.parent_path() / fs::read_symlink(target, error);
        if (error)
            fail(path, error.message());
    }
    if (target.empty() || target.filename().empty())
        fail(path, "not a file name");
    const fs::file_status status = fs::status(target, error);
    if (fs::exists(status) && !fs::is_regular_file(status))
        fail(path, fs::is_directory(status) ? "it is a folder" : "it is not a regular file");
    return target;
}

} // namespace

void checkWriteAtomically(const fs::path& path) {
    if (!isStandardStream(path))
        TemporaryFile file(targetOf(path));
}

void writeFileAtomically(const fs::path& path, std::string_view bytes) {
    if (isStandardStream(path))
        return writeAll(STDOUT_FILENO, "standard output", bytes);
    TemporaryFile file(targetOf(path));
    file.write(bytes);
    file.rename();
}

} // namespace strobe
