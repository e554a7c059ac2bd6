#include "shapes/ply.h"

#include "core/util/file_bytes.h"
#include "core/util/memory.h"
#include "core/util/resource_policy.h"
#include "shapes/ply_header.h"

#include <bit>
#include <charconv>
#include <cstring>

namespace strobe {
namespace {

using namespace ply;

/// Reads the numbers of the body in order.
class Body {
  public:
    Body(std::string_view bytes, Format format, const Failure& fail)
        : m_bytes(bytes), m_format(format), m_fail(fail) {}

    /// Returns the next number; double represents every PLY type exactly.
    double next(Scalar type) { return m_format == Format::Ascii ? nextWord(type) : nextBinary(type); }

    /// Returns the next number as the count of a list.
    uint64_t nextCount(Scalar type, const Property& property) {
        const double n = next(type);
        if (n < 0)
            m_fail("a list " + quoteWord(property.name) + " has a negative count");
        return static_cast<uint64_t>(n);
    }

    void skip(const Property& property) {
        if (!property.listCount) {
            next(property.type);
            return;
        }
        for (uint64_t n = nextCount(*property.listCount, property); n > 0; --n)
            next(property.type);
    }

    /// Fails if the remaining bytes are too few for `element`; to be called before memory is reserved for it.
    void requireRoom(const Element& element) const {
        uint64_t rowBytes = 0;
        for (const Property& p : element.properties)
            rowBytes += m_format == Format::Ascii ? 2 : byteSize(p.listCount.value_or(p.type));
        const uint64_t left = m_bytes.size() - m_pos + 1; // the last ASCII number may end with the file
        if (rowBytes > 0 && element.count > left / rowBytes)
            m_fail("is too short for the " + std::to_string(element.count) + " rows of element " +
                   quoteWord(element.name) + " that the header declares");
    }

    /// Returns true if the numbers of the file have the byte layout of memory.
    bool isNative() const { return m_format == kNative; }
    /// Returns the next `size` bytes without consuming them; null if there are fewer.
    const char* peek(size_t size) const {
        return m_bytes.size() - m_pos < size ? nullptr : m_bytes.data() + m_pos;
    }
    void advance(size_t size) { m_pos += size; }
    /// Consumes and returns the next `size` bytes; fails if there are fewer.
    const char* take(size_t size) {
        const char* bytes = peek(size);
        if (!bytes)
            failTruncated();
        advance(size);
        return bytes;
    }

    size_t trailingBytes() const {
        size_t i = m_pos;
        while (i < m_bytes.size() && isSpace(m_bytes[i]))
            ++i;
        return m_bytes.size() - i;
    }

    /// Sets the current element, for messages.
    void enter(const Element& element) { m_element = element.name; }

  private:
    [[noreturn]] void failTruncated() const {
        m_fail("ends in the middle of element " + quoteWord(m_element));
    }

    double nextWord(Scalar type) {
        while (m_pos < m_bytes.size() && isSpace(m_bytes[m_pos]))
            ++m_pos;
        size_t stop = m_pos;
        while (stop < m_bytes.size() && !isSpace(m_bytes[stop]))
            ++stop;
        if (stop == m_pos)
            failTruncated();
        const std::string_view word = m_bytes.substr(m_pos, stop - m_pos);
        m_pos = stop;
        const char* begin = word.data() + (word[0] == '+' ? 1 : 0);
        double value = 0;
        const auto [end, error] = std::from_chars(begin, word.data() + word.size(), value);
        if (error != std::errc() || end != word.data() + word.size())
            m_fail(quoteWord(word) + " in element " + quoteWord(m_element) + " is not a number");
        if (type < Scalar::F32 && !(value == std::floor(value) && std::abs(value) < 0x1p32))
            m_fail(quoteWord(word) + " in element " + quoteWord(m_element) + " is not an integer of 32 bits");
        return value;
    }

    double nextBinary(Scalar type) {
        const size_t size = byteSize(type);
        if (m_bytes.size() - m_pos < size)
            failTruncated();
        char raw[8];
        std::memcpy(raw, m_bytes.data() + m_pos, size);
        m_pos += size;
        if (m_format != kNative)
            std::reverse(raw, raw + size);
        switch (type) {
        case Scalar::I8:
            return as<int8_t>(raw);
        case Scalar::U8:
            return as<uint8_t>(raw);
        case Scalar::I16:
            return as<int16_t>(raw);
        case Scalar::U16:
            return as<uint16_t>(raw);
        case Scalar::I32:
            return as<int32_t>(raw);
        case Scalar::U32:
            return as<uint32_t>(raw);
        case Scalar::F32:
            return as<float>(raw);
        case Scalar::F64:
            return as<double>(raw);
        }
        return 0;
    }

    template <class T>
    static double as(const char* raw) {
        T value;
        std::memcpy(&value, raw, sizeof value);
        return static_cast<double>(value);
    }

    static constexpr Format kNative =
        std::endian::native == std::endian::little ? Format::Little : Format::Big;
    std::string_view m_bytes;
    Format m_format;
    const Failure& m_fail;
    size_t m_pos = 0;
    std::string m_element;
};

// Indices into a row of the vertex values that are kept: position, normal, uv.
constexpr int kNormalSlot = 3, kUvSlot = 6, kSlotCount = 8;

/// Returns the index into the row for each vertex property; -1: skipped.
std::vector<int> vertexSlots(const Element& vertex, const Failure& fail) {
    const auto find = [&](std::string_view name) {
        for (size_t i = 0; i < vertex.properties.size(); ++i) {
            if (vertex.properties[i].name == name && !vertex.properties[i].listCount)
                return static_cast<int>(i);
        }
        return -1;
    };
    std::vector<int> slots(vertex.properties.size(), -1);
    const int x = find("x"), y = find("y"), z = find("z");
    if (x < 0 || y < 0 || z < 0)
        fail("the vertices lack x, y or z");
    slots[x] = 0;
    slots[y] = 1;
    slots[z] = 2;
    const int nx = find("nx"), ny = find("ny"), nz = find("nz");
    const int normalCount = (nx >= 0) + (ny >= 0) + (nz >= 0);
    if (normalCount == 3) {
        slots[nx] = kNormalSlot;
        slots[ny] = kNormalSlot + 1;
        slots[nz] = kNormalSlot + 2;
    } else if (normalCount > 0) {
        fail("the vertices have some of nx, ny and nz, but not all");
    }
    constexpr std::string_view pairs[][2] = {
        {"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}};
    for (const auto& pair : pairs) {
        const int u = find(pair[0]), v = find(pair[1]);
        if (u >= 0 && v >= 0) {
            slots[u] = kUvSlot;
            slots[v] = kUvSlot + 1;
            break;
        }
    }
    return slots;
}

/// Reads a row of float properties in the byte layout of memory.
void readNativeRow(const std::vector<int>& slots, Body& body, float* row) {
    const char* bytes = body.take(slots.size() * sizeof(float));
    for (size_t p = 0; p < slots.size(); ++p)
        if (slots[p] >= 0)
            std::memcpy(&row[slots[p]], bytes + p * sizeof(float), sizeof(float));
}

template <class T>
void reserveHugePages(std::vector<T>& values, size_t count) {
    values.reserve(count);
    adviseHugePages(values.data(), count * sizeof(T));
}

void readVertices(const Element& vertex, Body& body, const Failure& fail, PlyMesh& mesh) {
    const std::vector<int> slots = vertexSlots(vertex, fail);
    const auto hasSlot = [&](int slot) { return std::find(slots.begin(), slots.end(), slot) != slots.end(); };
    const bool hasNormals = hasSlot(kNormalSlot), hasUvs = hasSlot(kUvSlot);
    const bool isNative = body.isNative() && std::all_of(vertex.properties.begin(), vertex.properties.end(),
                                                         [](const Property& p) {
                                                             return p.type == Scalar::F32 && !p.listCount;
                                                         });
    reserveHugePages(mesh.positions, vertex.count + PlyMesh::kSpareCapacity);
    reserveHugePages(mesh.normals, hasNormals ? vertex.count : 0);
    reserveHugePages(mesh.uvs, hasUvs ? vertex.count : 0);
    float row[kSlotCount] = {};
    for (uint64_t i = 0; i < vertex.count; ++i) {
        if (isNative)
            readNativeRow(slots, body, row);
        for (size_t p = 0; p < slots.size() && !isNative; ++p) {
            if (slots[p] < 0)
                body.skip(vertex.properties[p]);
            else
                row[slots[p]] = static_cast<float>(body.next(vertex.properties[p].type));
        }
        mesh.positions.emplace_back(row[0], row[1], row[2]);
        if (hasNormals)
            mesh.normals.emplace_back(row[kNormalSlot], row[kNormalSlot + 1], row[kNormalSlot + 2]);
        if (hasUvs)
            mesh.uvs.emplace_back(row[kUvSlot], row[kUvSlot + 1]);
    }
}

bool isIndexList(const Property& p) { return p.name == "vertex_indices" || p.name == "vertex_index"; }

/// Reads one list of vertex indices and appends its fan of triangles.
void readFace(uint64_t face, const Property& corners, uint64_t vertexCount, Body& body, const Failure& fail,
              std::vector<uint32_t>& indices) {
    const uint64_t count = body.nextCount(*corners.listCount, corners);
    if (count < 3)
        fail("face " + std::to_string(face) + " has fewer than three corners");
    uint32_t first = 0, previous = 0;
    for (uint64_t i = 0; i < count; ++i) {
        const double value = body.next(corners.type);
        if (!(value >= 0 && value < static_cast<double>(vertexCount)))
            fail("face " + std::to_string(face) + " refers to vertex " +
                 std::to_string(static_cast<int64_t>(value)) + ", but there are " +
                 std::to_string(vertexCount) + " vertices");
        const auto index = static_cast<uint32_t>(value);
        if (i == 0)
            first = index;
        if (i >= 2)
            indices.insert(indices.end(), {first, previous, index});
        previous = index;
    }
}

/// Reads a triangle with a count of one byte and indices in the byte layout of memory. Returns false, and
/// consumes nothing, if the face is not a valid triangle.
bool readNativeTriangle(uint64_t vertexCount, Body& body, std::vector<uint32_t>& indices) {
    uint32_t corners[3];
    const char* bytes = body.peek(1 + sizeof corners);
    if (!bytes || bytes[0] != 3)
        return false;
    std::memcpy(corners, bytes + 1, sizeof corners);
    if (corners[0] >= vertexCount || corners[1] >= vertexCount || corners[2] >= vertexCount)
        return false;
    indices.insert(indices.end(), corners, corners + 3);
    body.advance(1 + sizeof corners);
    return true;
}

void readFaces(const Element& faces, uint64_t vertexCount, Body& body, const Failure& fail,
               std::vector<uint32_t>& indices) {
    const auto corners = std::find_if(faces.properties.begin(), faces.properties.end(), isIndexList);
    if (corners == faces.properties.end() || !corners->listCount || corners->type >= Scalar::F32)
        fail("the faces have no list of integers named vertex_indices or vertex_index");
    reserveHugePages(indices, 3 * faces.count);
    const bool isNative = body.isNative() && faces.properties.size() == 1 &&
                          byteSize(*corners->listCount) == 1 && byteSize(corners->type) == sizeof(uint32_t);
    for (uint64_t i = 0; i < faces.count; ++i) {
        if (isNative && readNativeTriangle(vertexCount, body, indices))
            continue;
        for (const Property& p : faces.properties) {
            if (&p == &*corners)
                readFace(i, p, vertexCount, body, fail, indices);
            else
                body.skip(p);
        }
    }
}

} // namespace

PlyMesh parsePly(std::string_view contents, const std::string& fileName, const Location& where,
                 bool mayBeEmpty) {
    const Failure fail{fileName, where};
    const Header header = parseHeader(contents, fail);
    const Element* vertex = header.find("vertex");
    const Element* face = header.find("face");
    if (mayBeEmpty && vertex && face && (vertex->count == 0 || face->count == 0))
        return {};
    if (!vertex || vertex->count == 0)
        fail("has no vertices");
    if (!face || face->count == 0)
        fail(header.find("tristrips") ? "has triangle strips, which are not supported" : "has no faces");
    if (vertex->count > UINT32_MAX)
        fail("has more vertices than 32-bit indices allow");

    PlyMesh mesh;
    Body body(contents.substr(header.size), header.format, fail);
    for (const Element& element : header.elements) {
        body.enter(element);
        body.requireRoom(element);
        if (&element == vertex)
            readVertices(element, body, fail, mesh);
        else if (&element == face)
            readFaces(element, vertex->count, body, fail, mesh.indices);
        else if (!element.properties.empty())
            for (uint64_t i = 0; i < element.count; ++i)
                std::for_each(element.properties.begin(), element.properties.end(),
                              [&](const Property& p) { body.skip(p); });
    }
    mesh.trailingBytes = body.trailingBytes();
    return mesh;
}

PlyMesh readPlyFile(const std::filesystem::path& path, const Location& where, bool mayBeEmpty) {
    FileBytes file;
    try {
        file = readFileBytes(path, [&](uint64_t bytes) { // the file and a mesh of about the same size
            resourcePolicyOf(where).requireMemory(2 * bytes, "the mesh \"" + path.string() + '"',
                                                  "simplify it", where);
        });
    } catch (const Error&) {
        throw;
    } catch (const std::runtime_error& e) {
        throw Error(where, "\"" + path.string() + "\" cannot be read: " + e.what());
    }
    return parsePly(file.view(), path.string(), where, mayBeEmpty);
}

} // namespace strobe
