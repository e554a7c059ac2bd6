// Messages of tev's TCP protocol: length in bytes (including its own four), type, fields. Integers and floats
// are little-endian, strings zero-terminated.
#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace strobe {

/// A message under construction.
class TevMessage {
  public:
    enum Type : uint8_t { CreateImage = 4, UpdateImage = 6 };

    explicit TevMessage(Type type) : m_bytes(4, '\0') { *this << type; }
    /// Appends a number.
    template <class T>
    requires std::integral<T> || std::floating_point<T> || std::same_as<T, Type> TevMessage&
    operator<<(T value) {
        static_assert(std::endian::native == std::endian::little);
        char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        m_bytes.append(bytes, sizeof value);
        return *this;
    }
    /// Appends a string.
    TevMessage& operator<<(std::string_view text) {
        m_bytes.append(text).push_back('\0');
        return *this;
    }
    /// Appends n floats.
    TevMessage& append(const float* values, size_t n) {
        m_bytes.append(reinterpret_cast<const char*>(values), n * sizeof(float));
        return *this;
    }
    /// Returns the complete message.
    std::string bytes() && {
        const uint32_t size = uint32_t(m_bytes.size());
        std::memcpy(m_bytes.data(), &size, sizeof size);
        return std::move(m_bytes);
    }

  private:
    std::string m_bytes;
};

} // namespace strobe
