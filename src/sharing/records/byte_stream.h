// Numbers in strings of bytes.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace strobe {

static_assert(std::endian::native == std::endian::little);

/// Writes numbers to a string.
class ByteWriter {
  public:
    void clear() { m_size = 0; }
    /// Reserves space for this many bytes.
    void reserve(size_t bytes) {
        if (m_size + bytes > m_bytes.size())
            m_bytes.resize(2 * m_bytes.size() + bytes);
    }
    /// Precondition: space is reserved.
    template <class Number>
    void add(Number value) {
        std::memcpy(&m_bytes[m_size], &value, sizeof value);
        m_size += sizeof value;
    }
    /// Overwrites a number.
    template <class Number>
    void set(size_t position, Number value) {
        std::memcpy(&m_bytes[position], &value, sizeof value);
    }
    /// Returns the address of the next byte, for writers that call setEnd afterwards. Precondition: space is
    /// reserved.
    char* end() { return m_bytes.data() + m_size; }
    void setEnd(const char* end) { m_size = size_t(end - m_bytes.data()); }
    std::string_view bytes() const { return {m_bytes.data(), m_size}; }
    size_t size() const { return m_size; }

  private:
    std::string m_bytes; ///< of which m_size are written
    size_t m_size = 0;
};

/// Returns the number at some bytes.
template <class Number>
Number numberAt(const char* bytes) {
    Number value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

/// Reads the numbers of a ByteWriter from bytes that may be damaged. At the end of the bytes, it reads 0 and
/// fails.
class ByteReader {
  public:
    explicit ByteReader(std::string_view bytes) : m_bytes(bytes) {}

    template <class Number>
    Number next() {
        const char* bytes = skip(sizeof(Number));
        return bytes ? numberAt<Number>(bytes) : Number(0);
    }
    /// Returns the next bytes; null: fewer are left.
    const char* skip(size_t count) {
        if (count > left()) {
            m_hasFailed = true;
            m_position = m_bytes.size();
            return nullptr;
        }
        m_position += count;
        return m_bytes.data() + m_position - count;
    }
    bool hasFailed() const { return m_hasFailed; }
    size_t position() const { return m_position; }
    size_t left() const { return m_bytes.size() - m_position; }

  private:
    std::string_view m_bytes;
    size_t m_position = 0;
    bool m_hasFailed = false;
};

} // namespace strobe
