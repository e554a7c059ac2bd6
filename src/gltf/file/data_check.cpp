#include "gltf/file/data_check.h"

#include "gltf/file/accessor.h"

#include <array>
#include <fstream>
#include <set>

namespace strobe::gltf {
namespace {

/// Returns whether bytes begin as a PNG or JPEG image does, with a complete header.
bool isImage(std::span<const unsigned char> bytes) {
    constexpr std::array<unsigned char, 16> kPng{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n',
                                                 0,    0,   0,   13,  'I',  'H',  'D',  'R'};
    constexpr size_t kPngHeader = 33, kJpegHeader = 20;
    if (bytes.size() >= kPngHeader && std::equal(kPng.begin(), kPng.end(), bytes.begin()))
        return true;
    // The marker of a JPEG is followed by another one.
    return bytes.size() >= kJpegHeader && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff &&
           bytes[3] >= 0xc0;
}

class DataChecker {
  public:
    explicit DataChecker(const Document& document) : m_document(document), m_model(document.model()) {}

    Deviations run() {
        findDirections();
        for (size_t i = 0; i < m_model.accessors.size(); ++i)
            checkBounds(i);
        for (size_t i = 0; i < m_model.meshes.size(); ++i)
            for (size_t k = 0; k < m_model.meshes[i].primitives.size(); ++k)
                checkPrimitive(m_model.meshes[i].primitives[k],
                               item("meshes", i) + "." + item("primitives", k));
        for (size_t i = 0; i < m_model.skins.size(); ++i)
            checkMatrices(m_model.skins[i].inverseBindMatrices, item("skins", i) + ".inverseBindMatrices");
        for (size_t i = 0; i < m_model.images.size(); ++i)
            checkImage(m_model.images[i], item("images", i));
        return std::move(m_out);
    }

  private:
    /// Adds a deviation, unless there is one of its kind.
    void add(const char* kind, const std::string& jsonPath, const std::string& message) {
        if (m_kinds.insert(kind).second)
            m_out.emplace_back(jsonPath, message);
    }
    /// Returns the stored numbers of an accessor; empty if it cannot be read or too many have been read.
    std::vector<float> numbers(int accessor, const std::string& jsonPath) {
        if (accessor < 0 || size_t(accessor) >= m_model.accessors.size())
            return {};
        const size_t count = m_model.accessors[size_t(accessor)].count;
        if (count > m_budget / components(accessor))
            return {};
        m_budget -= count * components(accessor);
        try {
            return readStored(m_document, accessor, jsonPath);
        } catch (const Error&) {
            return {};
        }
    }
    size_t components(int accessor) const {
        return size_t(std::max(
            tinygltf::GetNumComponentsInType(uint32_t(m_model.accessors[size_t(accessor)].type)), 1));
    }

    /// Collects the accessors that readDirections checks for numbers that are not finite.
    void findDirections() {
        for (const auto& mesh : m_model.meshes)
            for (const auto& primitive : mesh.primitives)
                for (const auto& [name, accessor] : primitive.attributes)
                    if (name == "NORMAL" || name == "TANGENT")
                        m_directions.insert(accessor);
    }

    void checkBounds(size_t index) {
        const auto& accessor = m_model.accessors[index];
        const bool isFloat = accessor.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT;
        const bool hasBounds = !accessor.minValues.empty() || !accessor.maxValues.empty();
        if ((!isFloat && !hasBounds) || (accessor.bufferView < 0 && !accessor.sparse.isSparse))
            return; // zeros may lie outside of the bounds: extensions may provide the data
        const std::string path = item("accessors", index);
        const std::vector<float> data = numbers(int(index), path);
        const size_t n = components(int(index));
        for (size_t i = 0; i < data.size(); ++i)
            if (!std::isfinite(data[i])) {
                if (!m_directions.count(int(index)))
                    add("finite", path, "element " + std::to_string(i / n) + " is not finite");
                return;
            }
        for (size_t c = 0; c < n && hasBounds; ++c)
            checkBound(accessor, data, c, n, path);
    }
    /// Bounds in files are rounded.
    void checkBound(const tinygltf::Accessor& accessor, const std::vector<float>& data, size_t c, size_t n,
                    const std::string& path) {
        const bool hasMin = c < accessor.minValues.size(), hasMax = c < accessor.maxValues.size();
        const double least = hasMin ? accessor.minValues[c] : -HUGE_VAL;
        const double greatest = hasMax ? accessor.maxValues[c] : HUGE_VAL;
        const double size = std::max({hasMin ? std::abs(least) : 0, hasMax ? std::abs(greatest) : 0,
                                      hasMin && hasMax ? greatest - least : 0});
        const double tolerance = 1e-4 * size + 1e-6;
        for (size_t i = c; i < data.size(); i += n)
            if (data[i] < least - tolerance || data[i] > greatest + tolerance)
                return add("bounds", path, "element " + std::to_string(i / n) + " is outside of min and max");
    }

    void checkPrimitive(const tinygltf::Primitive& primitive, const std::string& path) {
        const auto find = [&](const char* name) {
            const auto it = primitive.attributes.find(name);
            return it == primitive.attributes.end() ? -1 : it->second;
        };
        checkIndices(primitive.indices, find("POSITION"), path + ".indices");
        const std::string colorPath = path + ".attributes.COLOR_0";
        if (const int color = find("COLOR_0"); isFloat(color))
            for (const float x : numbers(color, colorPath))
                if (!(x >= 0 && x <= 1))
                    add("color", colorPath, "a color is not between 0 and 1");
        const std::string tangentPath = path + ".attributes.TANGENT";
        const int tangent = find("TANGENT");
        const std::vector<float> tangents =
            isFloat(tangent) ? numbers(tangent, tangentPath) : std::vector<float>();
        for (size_t i = 3; i < tangents.size() && components(tangent) == 4; i += 4)
            if (std::abs(tangents[i]) != 1)
                add("tangent", tangentPath, "the fourth component of a tangent is neither 1 nor -1");
    }
    bool isFloat(int accessor) const {
        return accessor >= 0 && size_t(accessor) < m_model.accessors.size() &&
               m_model.accessors[size_t(accessor)].componentType == TINYGLTF_COMPONENT_TYPE_FLOAT;
    }
    void checkIndices(int indices, int positions, const std::string& path) {
        if (positions < 0 || size_t(positions) >= m_model.accessors.size())
            return;
        const size_t count = m_model.accessors[size_t(positions)].count;
        for (const float index : numbers(indices, path)) { // exact below 2^24
            if (double(index) >= double(count))
                return add("index", path, "index " + std::to_string(uint64_t(index)) + " is out of range");
            const int type = m_model.accessors[size_t(indices)].componentType;
            if ((type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && index == 255) ||
                (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT && index == 65535))
                return add("index", path, "the greatest index of the componentType must not be used");
        }
    }
    void checkMatrices(int accessor, const std::string& path) {
        const std::vector<float> m = numbers(accessor, path);
        for (size_t i = 0; i + 15 < m.size() && components(accessor) == 16; i += 16)
            if (m[i + 3] != 0 || m[i + 7] != 0 || m[i + 11] != 0 || m[i + 15] != 1)
                return add("matrix", path, "the fourth row of a matrix is not (0, 0, 0, 1)");
    }

    void checkImage(const tinygltf::Image& image, const std::string& path) {
        try {
            if (image.bufferView >= 0)
                checkHeader(viewBytes(m_document, image.bufferView, path), path);
            else if (!image.image.empty())
                checkHeader(image.image, path);
            else if (!image.uri.empty())
                checkFile(image.uri, path);
        } catch (const Error&) { // the image must not be read; an error where it is used
        }
    }
    void checkHeader(std::span<const unsigned char> bytes, const std::string& path) {
        if (!isImage(bytes))
            add("image", path, "is not a PNG or JPEG image");
    }
    void checkFile(const std::string& uri, const std::string& path) {
        const std::filesystem::path name = m_document.resolve(uri);
        std::error_code ignored;
        std::array<unsigned char, 64> head;
        std::ifstream file(name, std::ios::binary);
        if (!file || !std::filesystem::is_regular_file(name, ignored))
            return add("missing image", path + ".uri", cannotRead(name));
        file.read(reinterpret_cast<char*>(head.data()), head.size());
        checkHeader(std::span(head).first(size_t(file.gcount())), path);
    }

    const Document& m_document;
    const tinygltf::Model& m_model;
    size_t m_budget = size_t(1) << 27; ///< numbers to read; limits the time for files that repeat accessors
    std::set<int> m_directions;
    std::set<std::string> m_kinds;
    Deviations m_out;
};

} // namespace

std::string cannotRead(const std::filesystem::path& image) {
    return "\"" + image.string() + "\" cannot be read; the textures with this image are ignored";
}

Deviations findDataDeviations(const Document& document) { return DataChecker(document).run(); }

} // namespace strobe::gltf
