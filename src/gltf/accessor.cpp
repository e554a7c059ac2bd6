#include "gltf/accessor.h"

#include <cstring>

namespace strobe::gltf {
namespace {

/// Accessors without a buffer view are all zeros: nothing in the file pays for their size.
constexpr size_t kMaxUnbacked = size_t(1) << 24;

/// The place of something an accessor refers to: "meshes[0]… (accessors[3])".
std::string within(const std::string& place, int accessor) {
    return place + " (" + item("accessors", size_t(accessor)) + ")";
}

size_t componentSize(const Document& document, int type, const std::string& place) {
    switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
        return 4;
    default:
        document.fail(place, "unknown componentType " + std::to_string(type));
    }
}

/// Rows of `count` elements, `stride` bytes apart.
struct Elements {
    const unsigned char* data = nullptr;
    size_t count = 0, stride = 0;
};

/// `count` elements of `size` bytes, from `offset` in a view on.
Elements elementsIn(const Document& document, int bufferView, size_t offset, size_t count, size_t size,
                    const std::string& place) {
    const auto bytes = viewBytes(document, bufferView, place);
    const size_t given = document.model().bufferViews[size_t(bufferView)].byteStride;
    const size_t stride = given ? given : size;
    if (stride < size)
        document.fail(place, "its elements of " + std::to_string(size) + " bytes overlap: the stride is " +
                                 std::to_string(stride));
    const size_t room = bytes.size() >= offset ? bytes.size() - offset : 0;
    const size_t fit = room >= size ? (room - size) / stride + 1 : 0;
    if (count > fit)
        document.fail(place, std::to_string(count) + " elements do not fit into " +
                                 item("bufferViews", size_t(bufferView)) + ": there is room for " +
                                 std::to_string(fit));
    return {bytes.data() + std::min(offset, bytes.size()), count, stride};
}

template <class T>
T load(const unsigned char* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
}

/// Signed fractions have two encodings of -1.
template <class T>
float fraction(T value) {
    return std::max(float(value) / float(std::numeric_limits<T>::max()), -1.f);
}

float toFloat(const unsigned char* at, int type, bool normalized) {
    switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
        return normalized ? fraction(load<int8_t>(at)) : float(load<int8_t>(at));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return normalized ? fraction(*at) : float(*at);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
        return normalized ? fraction(load<int16_t>(at)) : float(load<int16_t>(at));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return normalized ? fraction(load<uint16_t>(at)) : float(load<uint16_t>(at));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return float(load<uint32_t>(at));
    default:
        return load<float>(at);
    }
}

uint32_t toInteger(const unsigned char* at, int type) {
    return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? *at
           : type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? load<uint16_t>(at)
                                                            : load<uint32_t>(at);
}

bool isUnsigned(int type) {
    return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
           type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

/// Bytes from one column of an element to the next: columns of matrices of small numbers begin at multiples
/// of four bytes.
struct Layout {
    int columns, rows;
    size_t component, column;
    size_t size() const { return size_t(columns) * column; }
};

Layout layoutOf(int type, size_t component) {
    const int n = tinygltf::GetNumComponentsInType(uint32_t(type));
    const int columns = type == TINYGLTF_TYPE_MAT2   ? 2
                        : type == TINYGLTF_TYPE_MAT3 ? 3
                        : type == TINYGLTF_TYPE_MAT4 ? 4
                                                     : 1;
    const size_t column = size_t(n / columns) * component;
    return {columns, n / columns, component, columns > 1 ? (column + 3) / 4 * 4 : column};
}

/// Reads all elements of an accessor as `Value`s made by `convert`.
template <class Value, class Convert>
std::vector<Value> read(const Document& document, int index, int components, const std::string& outer,
                        std::optional<size_t> count, const Convert& convert) {
    const tinygltf::Accessor& accessor = document.at(document.model().accessors, index, "accessor", outer);
    const std::string place = within(outer, index);
    if (const int n = tinygltf::GetNumComponentsInType(uint32_t(accessor.type)); n != components)
        document.fail(place,
                      "has " + std::to_string(n) + " components instead of " + std::to_string(components));
    if (count && *count != accessor.count)
        document.fail(place, "has " + std::to_string(accessor.count) + " elements instead of " +
                                 std::to_string(*count));
    if (accessor.bufferView < 0 && accessor.count > kMaxUnbacked)
        document.fail(place, std::to_string(accessor.count) + " elements without a bufferView");
    const Layout layout = layoutOf(accessor.type, componentSize(document, accessor.componentType, place));
    Elements elements;
    if (accessor.bufferView >= 0)
        elements = elementsIn(document, accessor.bufferView, accessor.byteOffset, accessor.count,
                              layout.size(), place);
    std::vector<Value> out(accessor.count * size_t(components));
    const auto readElement = [&](const unsigned char* from, size_t element) {
        Value* to = out.data() + element * size_t(components);
        for (int c = 0; c < layout.columns; ++c)
            for (int r = 0; r < layout.rows; ++r)
                *to++ = convert(from + size_t(c) * layout.column + size_t(r) * layout.component, accessor);
    };
    for (size_t i = 0; i < elements.count; ++i)
        readElement(elements.data + i * elements.stride, i);
    if (!accessor.sparse.isSparse)
        return out;

    const auto& sparse = accessor.sparse;
    const int type = sparse.indices.componentType;
    if (!isUnsigned(type))
        document.fail(place + ".sparse.indices", "are not unsigned integers");
    const auto some = size_t(std::max(sparse.count, 0));
    const Elements where = elementsIn(document, sparse.indices.bufferView, size_t(sparse.indices.byteOffset),
                                      some, componentSize(document, type, place), place + ".sparse.indices");
    const Elements values = elementsIn(document, sparse.values.bufferView, size_t(sparse.values.byteOffset),
                                       some, layout.size(), place + ".sparse.values");
    for (size_t i = 0; i < some; ++i) {
        const uint32_t element = toInteger(where.data + i * where.stride, type);
        if (element >= accessor.count)
            document.fail(place + ".sparse.indices", "index " + std::to_string(element) + " of " +
                                                         std::to_string(accessor.count) + " elements");
        readElement(values.data + i * values.stride, element);
    }
    return out;
}

template <class Vector, int kComponents>
std::vector<Vector> readVectors(const Document& document, int accessor, const std::string& place,
                                std::optional<size_t> count) {
    const std::vector<float> numbers = readFloats(document, accessor, kComponents, place, count);
    std::vector<Vector> out(numbers.size() / kComponents);
    for (size_t i = 0; i < out.size(); ++i)
        for (int k = 0; k < kComponents; ++k)
            out[i][k] = numbers[i * kComponents + size_t(k)];
    return out;
}

} // namespace

std::span<const unsigned char> viewBytes(const Document& document, int bufferView, const std::string& place) {
    const tinygltf::Model& model = document.model();
    const tinygltf::BufferView& view = document.at(model.bufferViews, bufferView, "bufferView", place);
    const std::string there = item("bufferViews", size_t(bufferView));
    const auto& bytes = document.at(model.buffers, view.buffer, "buffer", there).data;
    if (view.byteOffset > bytes.size() || view.byteLength > bytes.size() - view.byteOffset)
        document.fail(there, std::to_string(view.byteLength) + " bytes from byte " +
                                 std::to_string(view.byteOffset) + " on are not in " +
                                 item("buffers", size_t(view.buffer)) + " of " +
                                 std::to_string(bytes.size()) + " bytes");
    return std::span(bytes).subspan(view.byteOffset, view.byteLength);
}

size_t accessorCount(const Document& document, int accessor, const std::string& place) {
    return document.at(document.model().accessors, accessor, "accessor", place).count;
}

int accessorComponents(const Document& document, int accessor, const std::string& place) {
    return tinygltf::GetNumComponentsInType(
        uint32_t(document.at(document.model().accessors, accessor, "accessor", place).type));
}

std::vector<float> readFloats(const Document& document, int accessor, int components,
                              const std::string& place, std::optional<size_t> count) {
    auto numbers = read<float>(document, accessor, components, place, count,
                               [](const unsigned char* at, const tinygltf::Accessor& a) {
                                   return toFloat(at, a.componentType, a.normalized);
                               });
    for (size_t i = 0; i < numbers.size(); ++i)
        if (!std::isfinite(numbers[i]))
            document.fail(within(place, accessor),
                          "element " + std::to_string(i / size_t(components)) + " is not finite");
    return numbers;
}

std::vector<uint32_t> readIntegers(const Document& document, int accessor, int components,
                                   const std::string& place, std::optional<size_t> count) {
    const tinygltf::Accessor& a = document.at(document.model().accessors, accessor, "accessor", place);
    if (!isUnsigned(a.componentType) || a.normalized)
        document.fail(within(place, accessor), "must be of unsigned integers");
    return read<uint32_t>(document, accessor, components, place, count,
                          [](const unsigned char* at, const tinygltf::Accessor& of) {
                              return toInteger(at, of.componentType);
                          });
}

std::vector<V3f> readV3f(const Document& document, int accessor, const std::string& place,
                         std::optional<size_t> count) {
    return readVectors<V3f, 3>(document, accessor, place, count);
}

std::vector<V2f> readV2f(const Document& document, int accessor, const std::string& place,
                         std::optional<size_t> count) {
    return readVectors<V2f, 2>(document, accessor, place, count);
}

std::vector<M44f> readM44f(const Document& document, int accessor, const std::string& place,
                           std::optional<size_t> count) {
    const std::vector<float> numbers = readFloats(document, accessor, 16, place, count);
    std::vector<M44f> out(numbers.size() / 16);
    for (size_t i = 0; i < out.size(); ++i)
        for (int k = 0; k < 16; ++k)
            out[i][k / 4][k % 4] = numbers[16 * i + size_t(k)];
    return out;
}

} // namespace strobe::gltf
