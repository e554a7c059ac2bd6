#include "core/image/texel_codec.h"

#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace strobe {
namespace {

constexpr float kMaxWord = 65535;

template <class Code>
Code codeAt(const std::byte* codes, size_t i) {
    Code code;
    std::memcpy(&code, codes + i * sizeof(Code), sizeof(Code));
    return code;
}
template <class Code>
void setCode(std::byte* codes, size_t i, Code code) {
    std::memcpy(codes + i * sizeof(Code), &code, sizeof(Code));
}

uint16_t toWord(float value) { return uint16_t((value > 0 ? std::min(value, 1.f) : 0.f) * kMaxWord + .5f); }

/// Returns for each value of 16 bits the nearest of the ascending `values`.
std::vector<uint8_t> nearestCodes(const std::vector<float>& values) {
    std::vector<uint8_t> nearest(1 << 16);
    size_t code = 0;
    for (size_t word = 0; word < nearest.size(); ++word) {
        const float value = float(word) / kMaxWord;
        while (code + 1 < values.size() && values[code + 1] - value < value - values[code])
            ++code;
        nearest[word] = uint8_t(code);
    }
    return nearest;
}

} // namespace

TexelCodec TexelCodec::of(StoredType stored, const ColorEncoding& encoding) {
    const bool isFloat = stored == StoredType::Half || stored == StoredType::Float;
    const bool isEncoded = encoding.hasEffect(isFloat);
    if (stored == StoredType::Float)
        return {Float, {}};
    if (stored == StoredType::Byte && encoding.kind != ColorEncoding::Space)
        return {Byte, isEncoded ? encoding : ColorEncoding{}};
    return {stored == StoredType::Word && !isEncoded ? Word : Half, {}};
}

TexelCodec::TexelCodec(Kind kind, const ColorEncoding& encoding) : m_kind(kind) {
    if (kind == Byte) {
        for (int code = 0; code < 256; ++code)
            m_values.push_back(encoding.decode(float(code) / 255));
        m_nearest = nearestCodes(m_values);
    }
    if (kind == Word || kind == Half)
        for (uint32_t code = 0; code < 1 << 16; ++code)
            m_values.push_back(kind == Word ? float(code) / kMaxWord : imath_half_to_float(uint16_t(code)));
}

bool TexelCodec::keeps(StoredType stored) const {
    return (m_kind == Byte && stored == StoredType::Byte) || (m_kind == Word && stored == StoredType::Word) ||
           (m_kind == Half && stored == StoredType::Half) || (m_kind == Float && stored == StoredType::Float);
}

float TexelCodec::decode(const std::byte* codes, size_t i) const {
    if (m_kind == Float)
        return codeAt<float>(codes, i);
    return m_values[m_kind == Byte ? codeAt<uint8_t>(codes, i) : codeAt<uint16_t>(codes, i)];
}

void TexelCodec::addDecoded(const std::byte* codes, size_t first, size_t count, float weight,
                            float* sums) const {
    const float* values = m_values.data();
    const std::byte* begin = codes + first * bytes();
    if (m_kind == Byte)
        for (size_t i = 0; i < count; ++i)
            sums[i] += weight * values[codeAt<uint8_t>(begin, i)];
    else if (m_kind == Float)
        for (size_t i = 0; i < count; ++i)
            sums[i] += weight * codeAt<float>(begin, i);
    else
        for (size_t i = 0; i < count; ++i)
            sums[i] += weight * values[codeAt<uint16_t>(begin, i)];
}

void TexelCodec::encode(float value, std::byte* codes, size_t i) const {
    switch (m_kind) {
    case Byte:
        return setCode(codes, i, m_nearest[toWord(value)]);
    case Word:
        return setCode(codes, i, toWord(value));
    case Half:
        return setCode(codes, i, uint16_t(imath_float_to_half(value)));
    case Float:
        return setCode(codes, i, value);
    }
}

} // namespace strobe
