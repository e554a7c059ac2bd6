// Integers of variable length in strings of bytes.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace strobe {

static_assert(std::endian::native == std::endian::little);

/// The number of bytes that keep some integers and their signs: 0 … 8, or 16.
class IntegerLength {
  public:
    void include(int64_t value) { m_differences |= uint64_t(value) ^ uint64_t(value) << 1; }
    void include(__int128 value) {
        const auto low = int64_t(value);
        include(low);
        m_high |= uint64_t(int64_t(value >> 64) ^ (low >> 63));
    }
    size_t bytes() const {
        return m_high != 0 ? sizeof(__int128) : size_t(std::bit_width(m_differences) + 7) / 8;
    }

  private:
    uint64_t m_differences = 0; ///< the bits that differ from the next lower one
    uint64_t m_high = 0;        ///< not 0: more than 64 bits
};

/// Writes integers to a string: a byte with the length in bytes, then the bytes from the lowest one on, as
/// few as possible. 0 has the length 0. The integers of a group have a common length.
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
    /// Adds integers with a common length, which precedes them. Precondition: space is reserved.
    template <size_t kCount>
    void addGroup(const int64_t (&values)[kCount]) {
        IntegerLength length;
        for (const int64_t value : values)
            length.include(value);
        addByte(length.bytes());
        for (const int64_t value : values)
            addBytes(value, length.bytes());
    }
    /// The same for longer integers.
    void addLongGroup(const __int128* values, size_t count) {
        IntegerLength length;
        for (size_t i = 0; i < count; ++i)
            length.include(values[i]);
        addByte(length.bytes());
        if (length.bytes() <= sizeof(int64_t))
            for (size_t i = 0; i < count; ++i)
                addBytes(int64_t(values[i]), length.bytes());
        else
            for (size_t i = 0; i < count; ++i)
                addBytes(values[i], length.bytes());
    }
    void addByte(size_t byte) { m_bytes[m_size++] = char(byte); }
    /// Adds the lowest bytes of an integer. Precondition: space for all of its bytes is reserved.
    template <class Integer>
    void addBytes(Integer value, size_t length) {
        std::memcpy(&m_bytes[m_size], &value, sizeof value);
        m_size += length;
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
    /// Reads the integers of a group. If their length is not possible, it reads zeros and fails.
    template <size_t kCount>
    void nextGroup(int64_t (&values)[kCount]) {
        const size_t length = nextLength(sizeof(int64_t), kCount);
        nextBytes(length, kCount, [&](size_t i, int64_t value) { values[i] = value; });
    }
    /// The same for longer integers.
    void nextLongGroup(__int128* values, size_t count) {
        const size_t length = nextLength(sizeof(__int128), count);
        if (length <= sizeof(int64_t)) {
            nextBytes(length, count, [&](size_t i, int64_t value) { values[i] = value; });
            return;
        }
        for (size_t i = 0; i < count; ++i, m_position += length)
            values[i] = longAt(m_bytes.data() + m_position, length);
    }
    /// Reads a byte that is the length of `count` integers, up to `maxLength`. Returns 0 and fails if these
    /// are longer than what is left.
    size_t nextLength(size_t maxLength, size_t count) {
        const size_t length = left() > 0 ? uint8_t(m_bytes[m_position]) : maxLength + 1;
        if (length > maxLength || count * length >= left()) {
            fail();
            return 0;
        }
        ++m_position;
        return length;
    }
    /// Calls work(i, integer) for `count` integers of 0 … 8 bytes. Precondition: as many bytes are left.
    template <class Work>
    void nextBytes(size_t length, size_t count, const Work& work) {
        const char* in = m_bytes.data() + m_position;
        m_position += count * length;
        if (length == 0 || left() < sizeof(int64_t)) [[unlikely]] {
            for (size_t i = 0; i < count; ++i, in += length)
                work(i, length == 0 ? 0 : int64_t(longAt(in, length)));
            return;
        }
        const int unused = int(8 * (sizeof(int64_t) - length));
        for (size_t i = 0; i < count; ++i, in += length) {
            uint64_t value;
            std::memcpy(&value, in, sizeof value);
            work(i, int64_t(value << unused) >> unused);
        }
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
        return length == 0 ? 0 : longAt(first, length);
    }
    /// Returns the integer of the length 1 … 16 in the bytes from `first` on.
    static __int128 longAt(const char* first, size_t length) {
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
