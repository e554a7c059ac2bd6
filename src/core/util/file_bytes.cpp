#include "core/util/file_bytes.h"

#include "core/util/memory.h"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

namespace strobe {
namespace {

using Buffer = std::shared_ptr<char[]>;

Buffer newBuffer(size_t size) {
    Buffer buffer(new char[size]); // make_shared would zero it
    adviseHugePages(buffer.get(), size);
    return buffer;
}

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

FileBytes readPipe(const std::filesystem::path& path, const MemoryCheck& memoryCheck) {
    const File file(std::fopen(path.c_str(), "rb"), &std::fclose);
    if (!file)
        throw std::runtime_error(std::strerror(errno));
    std::string text;
    char chunk[1 << 16];
    while (const size_t count = std::fread(chunk, 1, sizeof chunk, file.get())) {
        text.append(chunk, count);
        if (memoryCheck)
            memoryCheck(text.capacity());
    }
    const Buffer buffer = newBuffer(text.size() + 1);
    text.copy(buffer.get(), text.size());
    return {buffer, text.size()};
}

FileBytes readPlain(const std::filesystem::path& path, const MemoryCheck& memoryCheck) {
    std::error_code code;
    if (std::filesystem::is_fifo(path, code))
        return readPipe(path, memoryCheck);
    if (!std::filesystem::is_regular_file(path, code))
        throw std::runtime_error(code ? code.message() : "not a regular file");
    const auto size = size_t(std::filesystem::file_size(path, code));
    const File file(std::fopen(path.c_str(), "rb"), &std::fclose);
    if (code || !file)
        throw std::runtime_error(code ? code.message() : std::strerror(errno));
    if (memoryCheck)
        memoryCheck(size);
    const Buffer buffer = newBuffer(size + 1);
    if (std::fread(buffer.get(), 1, size, file.get()) != size)
        throw std::runtime_error("the file was truncated while it was read");
    return {buffer, size};
}

/// Decompresses gzip data with zlib.
class Inflater {
  public:
    explicit Inflater(const FileBytes& packed) : m_input(packed.view()) {
        constexpr int kGzip = 16; // added to the window size: selects the gzip format
        if (inflateInit2(&m_zlib, MAX_WBITS + kGzip) != Z_OK)
            throw std::bad_alloc();
    }
    ~Inflater() { inflateEnd(&m_zlib); }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;

    bool isDone() const { return m_done; }
    /// Decompresses up to `size` bytes to `out`. Returns their number, which is smaller only at the end of
    /// the data. Throws std::runtime_error if the data is damaged or truncated.
    size_t read(char* out, size_t size) {
        size_t filled = 0;
        while (filled < size && !m_done) {
            const auto available = uInt(std::min<size_t>(m_input.size(), 1u << 30));
            const auto space = uInt(std::min<size_t>(size - filled, 1u << 30));
            // zlib does not write to its input.
            m_zlib.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(m_input.data()));
            m_zlib.avail_in = available;
            m_zlib.next_out = reinterpret_cast<Bytef*>(out + filled);
            m_zlib.avail_out = space;
            const int result = inflate(&m_zlib, Z_NO_FLUSH);
            m_input.remove_prefix(available - m_zlib.avail_in);
            filled += space - m_zlib.avail_out;
            if (result == Z_STREAM_END)
                finishMember();
            else if (result == Z_MEM_ERROR)
                throw std::bad_alloc();
            else if (result != Z_OK && result != Z_BUF_ERROR)
                throw std::runtime_error("the gzip data is damaged");
            else if (m_input.empty() && m_zlib.avail_out > 0)
                throw std::runtime_error("the gzip data is truncated");
        }
        return filled;
    }

  private:
    /// Continues with the next member, if there is one: a gzip file may consist of several.
    void finishMember() {
        m_done = m_input.size() < 2 || m_input[0] != '\x1f' || m_input[1] != '\x8b';
        if (!m_done)
            inflateReset(&m_zlib);
    }
    z_stream m_zlib{};
    std::string_view m_input; ///< not yet consumed
    bool m_done = false;
};

/// Decompresses gzip data of unknown size, into a buffer that is doubled as needed.
FileBytes decompress(const FileBytes& packed, const MemoryCheck& memoryCheck) {
    Inflater inflater(packed);
    size_t capacity = 4 * packed.size + 64, size = 0;
    Buffer buffer = newBuffer(capacity);
    for (;;) {
        size += inflater.read(buffer.get() + size, capacity - size);
        if (inflater.isDone())
            return {buffer, size};
        if (memoryCheck)
            memoryCheck(2 * capacity);
        const Buffer larger = newBuffer(2 * capacity);
        std::memcpy(larger.get(), buffer.get(), size);
        buffer = larger;
        capacity *= 2;
    }
}

} // namespace

FileBytes readFileBytes(const std::filesystem::path& path, const MemoryCheck& memoryCheck) {
    FileBytes file = readPlain(path, memoryCheck);
    return file.view().starts_with("\x1f\x8b") ? decompress(file, memoryCheck) : file;
}

} // namespace strobe
