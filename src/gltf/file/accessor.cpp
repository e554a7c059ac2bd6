#include "gltf/file/accessor.h"

#include <cstring>

namespace strobe::gltf {
namespace {

/// Limit of elements without a buffer view: they are zeros, so that the file's size does not bound their
/// number.
constexpr size_t kMaxUnbacked = size_t(1) << 24;

/// Returns the path of an accessor and of the reference to it: "meshes[0]… (accessors[3])".
std::string accessorPath(const std::string& jsonPath, int accessor) {
    return jsonPath + " (" + item("accessors", size_t(accessor)) + ")";
}

size_t componentSize(const Document& document, int type, const std::string& jsonPath) {
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
        document.fail(jsonPath, "unknown componentType " + std::to_string(type));
    }
}

/// `count` elements, `stride` bytes apart.
struct Elements {
    const unsigned char* data = nullptr;
    size_t count = 0;
    size_t stride = 0;
};

/// Returns `count` elements of `size` bytes, from byte `offset` of a buffer view. Throws an Error if they
/// exceed it.
Elements elementsIn(const Document& document, int bufferView, size_t offset, size_t count, size_t size,
                    const std::string& jsonPath) {
    const auto bytes = viewBytes(document, bufferView, jsonPath);
    const size_t byteStride = document.model().bufferViews[size_t(bufferView)].byteStride;
    const size_t stride = byteStride ? byteStride : size;
    if (stride < size)
        document.fail(jsonPath, "byteStride " + std::to_string(stride) +
                                    " is less than the size of an element, " + std::to_string(size));
    const size_t available = bytes.size() >= offset ? bytes.size() - offset : 0;
    const size_t capacity = available >= size ? (available - size) / stride + 1 : 0;
    if (count > capacity)
        document.fail(jsonPath, std::to_string(count) + " elements exceed " +
                                    item("bufferViews", size_t(bufferView)) + ", which has room for " +
                                    std::to_string(capacity));
    return {bytes.data() + std::min(offset, bytes.size()), count, stride};
}

template <class T>
T load(const unsigned char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

/// Returns a normalized integer as a fraction. The two lowest signed integers are both -1.
template <class T>
float fraction(T value) {
    return std::max(float(value) / float(std::numeric_limits<T>::max()), -1.f);
}

float toFloat(const unsigned char* bytes, int type, bool normalized) {
    switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
        return normalized ? fraction(load<int8_t>(bytes)) : float(load<int8_t>(bytes));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return normalized ? fraction(*bytes) : float(*bytes);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
        return normalized ? fraction(load<int16_t>(bytes)) : float(load<int16_t>(bytes));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return normalized ? fraction(load<uint16_t>(bytes)) : float(load<uint16_t>(bytes));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return float(load<uint32_t>(bytes));
    default:
        return load<float>(bytes);
    }
}

uint32_t toInteger(const unsigned char* bytes, int type) {
    return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? *bytes
           : type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? load<uint16_t>(bytes)
                                                            : load<uint32_t>(bytes);
}

bool isUnsigned(int type) {
    return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
           type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

/// The layout of an element, a matrix of `columns` columns. The columns of matrices begin at multiples of
/// four bytes.
struct Layout {
    int columns = 1, rows = 1;
    size_t componentBytes = 0;
    size_t columnBytes = 0; ///< from one column to the next
    size_t size() const { return size_t(columns) * columnBytes; }
};

Layout layoutOf(int type, size_t componentBytes) {
    const int n = tinygltf::GetNumComponentsInType(uint32_t(type));
    const int columns = type == TINYGLTF_TYPE_MAT2   ? 2
                        : type == TINYGLTF_TYPE_MAT3 ? 3
                        : type == TINYGLTF_TYPE_MAT4 ? 4
                                                     : 1;
    const int rows = n / columns;
    const size_t columnBytes = size_t(rows) * componentBytes;
    return {columns, rows, componentBytes, columns > 1 ? (columnBytes + 3) / 4 * 4 : columnBytes};
}

/// Reads the elements of one accessor, converted to numbers of type Value.
template <class Value, class Convert>
class ElementReader {
  public:
    /// `convert`: returns the number of a component from its bytes and the accessor.
    ElementReader(const Document& document, int index, const std::string& referencePath,
                  const Convert& convert)
        : m_document(document),
          m_accessor(document.at(document.model().accessors, index, "accessor", referencePath)),
          m_jsonPath(accessorPath(referencePath, index)), m_convert(convert) {}

    std::vector<Value> read(int components, std::optional<size_t> count) {
        check(components, count);
        m_components = size_t(components);
        m_layout = layoutOf(m_accessor.type, componentSize(m_document, m_accessor.componentType, m_jsonPath));
        Elements elements;
        if (m_accessor.bufferView >= 0)
            elements = elementsIn(m_document, m_accessor.bufferView, m_accessor.byteOffset, m_accessor.count,
                                  m_layout.size(), m_jsonPath);
        m_values.resize(m_accessor.count * m_components);
        for (size_t i = 0; i < elements.count; ++i)
            readElement(elements.data + i * elements.stride, i);
        if (m_accessor.sparse.isSparse)
            readSparse();
        return std::move(m_values);
    }

  private:
    void check(int components, std::optional<size_t> count) const {
        if (const int n = tinygltf::GetNumComponentsInType(uint32_t(m_accessor.type)); n != components)
            m_document.fail(m_jsonPath, "has " + std::to_string(n) + " components instead of " +
                                            std::to_string(components));
        if (count && *count != m_accessor.count)
            m_document.fail(m_jsonPath, "has " + std::to_string(m_accessor.count) + " elements instead of " +
                                            std::to_string(*count));
        if (m_accessor.bufferView < 0 && m_accessor.count > kMaxUnbacked)
            m_document.fail(m_jsonPath, std::to_string(m_accessor.count) + " elements without a bufferView");
    }

    void readElement(const unsigned char* bytes, size_t element) {
        Value* value = m_values.data() + element * m_components;
        for (int c = 0; c < m_layout.columns; ++c)
            for (int r = 0; r < m_layout.rows; ++r) {
                const size_t offset = size_t(c) * m_layout.columnBytes + size_t(r) * m_layout.componentBytes;
                *value++ = m_convert(bytes + offset, m_accessor);
            }
    }

    void readSparse() {
        const auto& sparse = m_accessor.sparse;
        const int indexType = sparse.indices.componentType;
        const std::string indicesPath = m_jsonPath + ".sparse.indices";
        if (!isUnsigned(indexType))
            m_document.fail(indicesPath, "componentType must be an unsigned integer");
        const auto count = size_t(std::max(sparse.count, 0));
        const Elements indices =
            elementsIn(m_document, sparse.indices.bufferView, size_t(sparse.indices.byteOffset), count,
                       componentSize(m_document, indexType, m_jsonPath), indicesPath);
        const Elements values =
            elementsIn(m_document, sparse.values.bufferView, size_t(sparse.values.byteOffset), count,
                       m_layout.size(), m_jsonPath + ".sparse.values");
        for (size_t i = 0; i < count; ++i) {
            const uint32_t element = toInteger(indices.data + i * indices.stride, indexType);
            if (element >= m_accessor.count)
                m_document.fail(indicesPath, "index " + std::to_string(element) +
                                                 " is out of range: the accessor has " +
                                                 std::to_string(m_accessor.count) + " elements");
            readElement(values.data + i * values.stride, element);
        }
    }

    const Document& m_document;
    const tinygltf::Accessor& m_accessor;
    const std::string m_jsonPath;
    const Convert& m_convert;
    Layout m_layout;
    size_t m_components = 0;
    std::vector<Value> m_values;
};

/// Returns the numbers of an accessor; see readFloats.
template <class Value, class Convert>
std::vector<Value> read(const Document& document, int index, int components, const std::string& jsonPath,
                        std::optional<size_t> count, const Convert& convert) {
    return ElementReader<Value, Convert>(document, index, jsonPath, convert).read(components, count);
}

template <class Vector, int kComponents>
std::vector<Vector> readVectors(const Document& document, int accessor, const std::string& jsonPath,
                                std::optional<size_t> count) {
    const std::vector<float> numbers = readFloats(document, accessor, kComponents, jsonPath, count);
    std::vector<Vector> out(numbers.size() / kComponents);
    for (size_t i = 0; i < out.size(); ++i)
        for (int k = 0; k < kComponents; ++k)
            out[i][k] = numbers[i * kComponents + size_t(k)];
    return out;
}

} // namespace

std::span<const unsigned char> viewBytes(const Document& document, int bufferView,
                                         const std::string& jsonPath) {
    const tinygltf::Model& model = document.model();
    const tinygltf::BufferView& view = document.at(model.bufferViews, bufferView, "bufferView", jsonPath);
    const std::string viewPath = item("bufferViews", size_t(bufferView));
    const auto& bytes = document.at(model.buffers, view.buffer, "buffer", viewPath).data;
    document.requireBuffer(size_t(view.buffer));
    if (view.byteOffset > bytes.size() || view.byteLength > bytes.size() - view.byteOffset)
        document.fail(viewPath, std::to_string(view.byteLength) + " bytes at offset " +
                                    std::to_string(view.byteOffset) + " exceed " +
                                    item("buffers", size_t(view.buffer)) + " of " +
                                    std::to_string(bytes.size()) + " bytes");
    return std::span(bytes).subspan(view.byteOffset, view.byteLength);
}

size_t accessorCount(const Document& document, int accessor, const std::string& jsonPath) {
    return document.at(document.model().accessors, accessor, "accessor", jsonPath).count;
}

int accessorComponents(const Document& document, int accessor, const std::string& jsonPath) {
    return tinygltf::GetNumComponentsInType(
        uint32_t(document.at(document.model().accessors, accessor, "accessor", jsonPath).type));
}

namespace {

std::vector<float> readAnyFloats(const Document& document, int accessor, int components,
                                 const std::string& jsonPath, std::optional<size_t> count) {
    return read<float>(document, accessor, components, jsonPath, count,
                       [](const unsigned char* bytes, const tinygltf::Accessor& accessor) {
                           return toFloat(bytes, accessor.componentType, accessor.normalized);
                       });
}

} // namespace

std::vector<V3f> readDirections(const Document& document, int accessor, const std::string& jsonPath,
                                std::optional<size_t> count, Diagnostics& diagnostics) {
    const int components = accessorComponents(document, accessor, jsonPath) == 4 ? 4 : 3; // 4: tangents
    const auto numbers = readAnyFloats(document, accessor, components, jsonPath, count);
    std::vector<V3f> out(numbers.size() / size_t(components));
    std::optional<size_t> invalid;
    for (size_t i = 0; i < out.size(); ++i) {
        const float* v = &numbers[i * size_t(components)];
        out[i] = {v[0], v[1], v[2]};
        if (std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]))
            continue;
        out[i] = V3f(0, 1, 0);
        if (!invalid)
            invalid = i;
    }
    if (invalid)
        document.tolerate(diagnostics, jsonPath, accessorPath(jsonPath, accessor),
                          "element " + std::to_string(*invalid) +
                              " is not finite; (0, 1, 0) takes the place of such elements");
    return out;
}

std::vector<float> readFloats(const Document& document, int accessor, int components,
                              const std::string& jsonPath, std::optional<size_t> count) {
    auto numbers = readAnyFloats(document, accessor, components, jsonPath, count);
    for (size_t i = 0; i < numbers.size(); ++i)
        if (!std::isfinite(numbers[i]))
            document.fail(accessorPath(jsonPath, accessor),
                          "element " + std::to_string(i / size_t(components)) + " is not finite");
    return numbers;
}

std::vector<float> readStored(const Document& document, int accessor, const std::string& jsonPath) {
    return read<float>(document, accessor, accessorComponents(document, accessor, jsonPath), jsonPath, {},
                       [](const unsigned char* bytes, const tinygltf::Accessor& accessor) {
                           return toFloat(bytes, accessor.componentType, false);
                       });
}

std::vector<uint32_t> readIntegers(const Document& document, int accessor, int components,
                                   const std::string& jsonPath, std::optional<size_t> count) {
    const tinygltf::Accessor& source =
        document.at(document.model().accessors, accessor, "accessor", jsonPath);
    if (!isUnsigned(source.componentType) || source.normalized)
        document.fail(accessorPath(jsonPath, accessor),
                      "must have unsigned integers that are not normalized");
    return read<uint32_t>(document, accessor, components, jsonPath, count,
                          [](const unsigned char* bytes, const tinygltf::Accessor& accessor) {
                              return toInteger(bytes, accessor.componentType);
                          });
}

std::vector<V3f> readV3f(const Document& document, int accessor, const std::string& jsonPath,
                         std::optional<size_t> count) {
    return readVectors<V3f, 3>(document, accessor, jsonPath, count);
}

std::vector<V2f> readV2f(const Document& document, int accessor, const std::string& jsonPath,
                         std::optional<size_t> count) {
    return readVectors<V2f, 2>(document, accessor, jsonPath, count);
}

std::vector<M44f> readM44f(const Document& document, int accessor, const std::string& jsonPath,
                           std::optional<size_t> count) {
    const std::vector<float> numbers = readFloats(document, accessor, 16, jsonPath, count);
    std::vector<M44f> out(numbers.size() / 16);
    for (size_t i = 0; i < out.size(); ++i)
        for (int k = 0; k < 16; ++k)
            out[i][k / 4][k % 4] = numbers[16 * i + size_t(k)];
    return out;
}

} // namespace strobe::gltf
