// Integers of variable length in strings of bytes.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace strobe {

static_assert(std::endian::native == std::endian::little);

/// Writes integers to a string: a byte with the length in bytes, then the bytes from the lowest one on, as
/// few as possible. 0 has the length 0.
class IntegerWriter {
  public:
    /// The maximum size of an integer.
    static constexpr size_t kMaxSize = 1 + sizeof(__int128);

    void clear() { m_size = 0; }
    /// Reserves space for this many integers.
    void reserve(size_t integers) {
        if (m_size + integers * kMaxSize > m_bytes.size())
            m_bytes.resize(2 * m_bytes.size() + integers * kMaxSize);
    }
    /// Precondition: space is reserved.
    void add(__int128 value) {
        if (const auto low = int64_t(value); low == value) [[likely]] {
            addShort(low);
            return;
        }
        const uint8_t length = lengthOf(value);
        m_bytes[m_size] = char(length);
        std::memcpy(&m_bytes[m_size + 1], &value, sizeof value);
        m_size += 1 + size_t(length);
    }
    std::string_view bytes() const { return {m_bytes.data(), m_size}; }
    size_t size() const { return m_size; }

  private:
    void addShort(int64_t value) {
        const auto magnitude = uint64_t(value ^ (value >> 63));
        const auto length = uint8_t(value == 0 ? 0 : std::bit_width(magnitude) / 8 + 1);
        m_bytes[m_size] = char(length);
        std::memcpy(&m_bytes[m_size + 1], &value, sizeof value);
        m_size += 1 + size_t(length);
    }
    /// Returns the number of bytes that keep the value and its sign.
    static uint8_t lengthOf(__int128 value) {
        const auto magnitude = (unsigned __int128)(value < 0 ? ~value : value);
        const uint64_t high = uint64_t(magnitude >> 64), low = uint64_t(magnitude);
        const int bits = high ? 128 - std::countl_zero(high) : 64 - std::countl_zero(low);
        return uint8_t(bits / 8 + 1);
    }

    std::string m_bytes; ///< longer than m_size
    size_t m_size = 0;
};

/// Reads the integers of an IntegerWriter from bytes that may be damaged. At the end of the bytes, and for an
/// invalid length, it reads 0 and fails.
class IntegerReader {
  public:
    explicit IntegerReader(std::string_view bytes) : m_bytes(bytes) {}

    __int128 next() {
        // Most integers are short and not at the end of the bytes.
        if (m_bytes.size() - m_position > sizeof(int64_t)) [[likely]] {
            const size_t length = uint8_t(m_bytes[m_position]);
            if (length <= sizeof(int64_t)) [[likely]] {
                int64_t value;
                std::memcpy(&value, m_bytes.data() + m_position + 1, sizeof value);
                m_position += 1 + length;
                return length == 0 ? 0 : extended(value, length);
            }
        }
        return nextLong();
    }
    /// Returns the next integer if it is within first … last, or fails and returns `first`.
    int64_t next(int64_t first, int64_t last) {
        const __int128 value = next();
        if (value >= first && value <= last)
            return int64_t(value);
        m_hasFailed = true;
        return first;
    }
    bool hasFailed() const { return m_hasFailed; }
    size_t position() const { return m_position; }
    size_t left() const { return m_bytes.size() - m_position; }

  private:
    /// Returns the integer in the lowest `length` bytes, of which the highest bit is the sign.
    static int64_t extended(int64_t value, size_t length) {
        const int unused = int(8 * (sizeof value - length));
        return int64_t(uint64_t(value) << unused) >> unused;
    }
    __int128 nextLong() {
        if (m_position >= m_bytes.size())
            return fail();
        const size_t length = uint8_t(m_bytes[m_position]);
        const size_t left = m_bytes.size() - m_position - 1;
        if (length > sizeof(__int128) || length > left)
            return fail();
        const char* first = m_bytes.data() + m_position + 1;
        m_position += 1 + length;
        if (length == 0)
            return 0;
        unsigned __int128 value = 0;
        std::memcpy(&value, first, length);
        const int unused = int(8 * (sizeof value - length));
        return __int128(value << unused) >> unused; // extends the sign
    }
    __int128 fail() {
        m_hasFailed = true;
        m_position = m_bytes.size();
        return 0;
    }

    std::string_view m_bytes;
    size_t m_position = 0;
    bool m_hasFailed = false;
};

} // namespace strobe
