#include "shapes/ply.h"

#include "shapes/plymesh.h"
#include "shapes/shape_params.h"

#include <bit>
#include <cstring>
#include <fstream>

namespace strobe {
namespace {

enum class Encoding { Ascii, Little, Big };
constexpr Encoding kEncodings[] = {Encoding::Ascii, Encoding::Little, Encoding::Big};

/// A writer of PLY files in any encoding.
class PlyWriter {
  public:
    explicit PlyWriter(Encoding encoding) : m_encoding(encoding) {
        const char* names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
        text = std::string("ply\nformat ") + names[static_cast<int>(encoding)] + " 1.0\ncomment test\n";
    }
    PlyWriter& header(const std::string& lines) {
        text += lines + "end_header\n";
        return *this;
    }
    template <class T>
    PlyWriter& put(T value) {
        if (m_encoding == Encoding::Ascii) {
            char word[40];
            std::snprintf(word, sizeof word, "%.9g\n", static_cast<double>(value));
            text += word;
            return *this;
        }
        char raw[sizeof(T)];
        std::memcpy(raw, &value, sizeof(T));
        if ((m_encoding == Encoding::Big) != (std::endian::native == std::endian::big))
            std::reverse(raw, raw + sizeof(T));
        text.append(raw, sizeof(T));
        return *this;
    }
    template <class T, class... More>
    PlyWriter& put(T value, More... more) {
        put(value);
        return put(more...);
    }
    std::string text;

  private:
    Encoding m_encoding;
};

const char* const kXyz = R"(property float x
property float y
property float z
)";

/// Returns a square with normals and uvs, other properties and another element, and a quad and a triangle.
template <class Count, class Index>
std::string square(Encoding encoding, const std::string& countType, const std::string& indexType) {
    PlyWriter ply(encoding);
    ply.header("element vertex 4\n" + std::string(kXyz) +
               R"(property uchar red
property double nx
property double ny
property double nz
property list uchar short rings
property float u
property float v
element material 2
property int id
property list uint8 float32 weights
element face 2
property list )" +
               countType + " " + indexType + R"( vertex_indices
property int32 face_index
)");
    const float corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (const auto& c : corners) {
        ply.put(c[0], c[1], 0.1f).put(uint8_t(200)).put(0.0, 0.0, 1.5);
        ply.put(uint8_t(2)).put(int16_t(-7), int16_t(300)).put(c[0] / 3, c[1]);
    }
    ply.put(int32_t(-5)).put(uint8_t(1)).put(2.5f).put(int32_t(6)).put(uint8_t(0));
    ply.put(Count(4)).put(Index(0), Index(1), Index(2), Index(3)).put(int32_t(-1));
    ply.put(Count(3)).put(Index(3), Index(2), Index(1)).put(int32_t(-1));
    return ply.text;
}

void expectSquare(const PlyMesh& mesh) {
    EXPECT_EQ(mesh.indices, (std::vector<uint32_t>{0, 1, 2, 0, 2, 3, 3, 2, 1}));
    ASSERT_EQ(mesh.positions.size(), 4u);
    EXPECT_EQ(mesh.positions[1], V3f(1, 0, 0.1f));
    EXPECT_EQ(mesh.positions[3], V3f(0, 1, 0.1f));
    ASSERT_EQ(mesh.normals.size(), 4u);
    EXPECT_EQ(mesh.normals[2], V3f(0, 0, 1.5f));
    ASSERT_EQ(mesh.uvs.size(), 4u);
    EXPECT_EQ(mesh.uvs[2], V2f(1.f / 3, 1));
    EXPECT_EQ(mesh.trailingBytes, 0u);
}

PlyMesh parse(const std::string& text) { return parsePly(text, "test.ply", {}); }

TEST(Ply, ReadsAllEncodingsAndIntegerTypes) {
    for (const Encoding e : kEncodings) {
        expectSquare(parse(square<uint8_t, int32_t>(e, "uchar", "int")));
        expectSquare(parse(square<int8_t, uint32_t>(e, "int8", "uint32")));
        expectSquare(parse(square<uint16_t, int16_t>(e, "ushort", "short")));
        expectSquare(parse(square<int16_t, uint16_t>(e, "int16", "uint16")));
        expectSquare(parse(square<int32_t, uint8_t>(e, "int", "uint8")));
        expectSquare(parse(square<uint32_t, int8_t>(e, "uint", "char")));
    }
}

TEST(Ply, PolygonsAreSplitIntoFans) {
    EXPECT_EQ(parse(R"(ply
format ascii 1.0
element vertex 5
property float x
property float y
property float z
element face 1
property list uchar int vertex_index
end_header
0 0 0
1 0 0
2 1 0
1 2 0
0 1 0
5 0 1 2 3 4
)")
                  .indices,
              (std::vector<uint32_t>{0, 1, 2, 0, 2, 3, 0, 3, 4}));
}

TEST(Ply, ReadsAllNamesOfTextureCoordinatesAndCrLfLines) {
    for (const char* names : {"u v", "s t", "texture_u texture_v", "texture_s texture_t"}) {
        const std::string both = names;
        const std::string u = both.substr(0, both.find(' ')), v = both.substr(both.find(' ') + 1);
        const std::string text =
            "ply\r\nformat ascii 1.0\r\nobj_info made here\r\nelement face 1\r\n"
            "property list uchar int vertex_indices\r\nelement vertex 3\r\n"
            "property float x\r\nproperty float y\r\nproperty float z\r\nproperty float " +
            v + "\r\nproperty float " + u +
            "\r\nend_header\r\n3 0 1 2\r\n0 0 0 .5 .25\r\n+1 0 0 0 0\r\n0 1e0 0 0 0";
        const PlyMesh mesh = parse(text);
        ASSERT_EQ(mesh.uvs.size(), 3u) << names;
        EXPECT_EQ(mesh.uvs[0], V2f(0.25f, 0.5f)) << names;
        EXPECT_EQ(mesh.positions[1], V3f(1, 0, 0));
    }
}

TEST(Ply, CountsTrailingBytes) {
    const std::string text = square<uint8_t, int32_t>(Encoding::Ascii, "uchar", "int");
    EXPECT_EQ(parse(text + " \n\n").trailingBytes, 0u);
    EXPECT_EQ(parse(text + " 1 2").trailingBytes, 3u);
}

std::string ascii(const std::string& vertexCount, const std::string& vertexProperties,
                  const std::string& faceCount, const std::string& faceProperties, const std::string& body) {
    return "ply\nformat ascii 1.0\nelement vertex " + vertexCount + "\n" + vertexProperties +
           "element face " + faceCount + "\n" + faceProperties + "end_header\n" + body;
}

const char* const kList = "property list uchar int vertex_indices\n";
/// The positions of three vertices.
const char* const kThree = "0 0 0\n1 0 0\n0 1 0\n";

/// A malformed file and a fragment of the expected message.
struct Malformed {
    std::string text, message;
};

std::vector<Malformed> malformedHeaders() {
    const std::string good = ascii("3", kXyz, "1", kList, std::string(kThree) + "3 0 1 2\n");
    const auto swap = [&](const std::string& from, const std::string& to) {
        std::string text = good;
        return text.replace(text.find(from), from.size(), to);
    };
    return {
        {"", "no end"},
        {"plx\n", "is not a PLY file"},
        {"ply\nelement vertex 3\n", "second line"},
        {swap("ascii", "binary_middle_endian"), "unknown format \"binary_middle_endian\""},
        {swap("1.0", "2.0"), "version \"2.0\""},
        {good.substr(0, good.find("end_header")), "no end"},
        {good.substr(0, 30), "no end"},
        {swap("element vertex 3", "element vertex three"), "not a number: \"three\""},
        {swap("element vertex 3", "element vertex -3"), "not a number: \"-3\""},
        {swap("element vertex 3", "element vertex 99999999999999999999"), "not a number"},
        {swap("element vertex 3", "element vertex"), "an invalid line that starts with \"element\""},
        {swap("element vertex 3", "property float x\nelement vertex 3"), "before any element"},
        {swap("element face 1", "element vertex 1"), "element \"vertex\" is declared twice"},
        {swap("property float y", "property float x"),
         "property \"x\" of element \"vertex\" is declared twice"},
        {swap("property float y", "property quad y"), "unknown property type \"quad\""},
        {swap("property float y", "property flo\x1b[31mat y"), "unknown property type \"flo?[31mat\""},
        {swap("property float y", "property float q"), "lack x, y or z"},
        {swap("property float y", "property list uchar float y"), "lack x, y or z"},
        {swap("property float z", "property float z\nproperty float nx"), "some of nx, ny and nz"},
        {swap("list uchar int", "list float int"), "must be of an integer type"},
        {swap("list uchar int", "list uchar float"), "no list of integers named vertex_indices"},
        {swap("vertex_indices", "corners"), "no list of integers"},
        {swap("property list uchar int vertex_indices", "property int vertex_indices"),
         "no list of integers"},
        {swap("element face", "element facet"), "has no faces"},
        {swap("element face", "element tristrips"), "triangle strips"},
        {swap("element face 1", "element face 0"), "has no faces"},
        {swap("element vertex 3", "element vertex 0"), "has no vertices"},
        {swap("element vertex", "element vortex"), "has no vertices"},
    };
}

std::vector<Malformed> malformedBodies() {
    const auto faces = [](const std::string& face) { return ascii("3", kXyz, "1", kList, kThree + face); };
    return {
        {faces("3 0 1 3\n"), "face 0 refers to vertex 3, but there are 3 vertices"},
        {faces("3 0 -1 2\n"), "face 0 refers to vertex -1"},
        {faces("2 0 1\n"), "face 0 has fewer than three corners"},
        {faces("-3 0 1 2\n"), "negative count"},
        {faces("3 0 1"), "ends in the middle of element \"face\""},
        {faces("1000000000 0 1 2"), "ends in the middle"},
        {faces("3 0 one 2\n"), "\"one\" in element \"face\" is not a number"},
        {faces("3 0 1.5 2\n"), "\"1.5\" in element \"face\" is not an integer"},
        {faces("3 0 nan 2\n"), "is not an integer"},
        {faces("3 0 1e30 2\n"), "is not an integer"},
        {faces("3.5 0 1 2\n"), "is not an integer"},
        {ascii("3", kXyz, "1", kList, "0 0 0 1 0 0 0 1 0x 3 0 1 2"), "\"0x\" in element \"vertex\""},
        {ascii("4000000000", kXyz, "1", kList, kThree), "too short for the 4000000000 rows"},
        {ascii("18446744073709551615", kXyz, "1", kList, kThree),
         "has more vertices than 32-bit indices allow"},
        {ascii("3", kXyz, "18446744073709551615", kList, kThree), "too short"},
        {ascii("4", kXyz, "1", kList, std::string(kThree) + "0"), "too short for the 4 rows"},
    };
}

std::vector<Malformed> malformedBinary() {
    std::vector<Malformed> cases;
    for (const Encoding e : {Encoding::Little, Encoding::Big}) {
        const std::string header = std::string("element vertex 3\n") + kXyz + "element face 1\n" +
                                   "property list int int vertex_indices\n";
        const auto file = [&](int32_t count, int32_t last) {
            PlyWriter ply(e);
            ply.header(header).put(0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f);
            return ply.put(count, 0, 1, last).text;
        };
        const std::string good = file(3, 2);
        EXPECT_EQ(parse(good).indices.size(), 3u);
        cases.push_back({file(3, 3), "refers to vertex 3"});
        cases.push_back({file(3, -1), "refers to vertex -1"});
        cases.push_back({file(-3, 2), "negative count"});
        cases.push_back({file(0, 2), "fewer than three"});
        cases.push_back({file(0x7fffffff, 2), "ends in the middle"});
        cases.push_back({good.substr(0, good.size() - 1), "ends in the middle of element \"face\""});
        cases.push_back({good.substr(0, good.size() - 20), "too short for the 3 rows of element \"vertex\""});
        cases.push_back({good.substr(0, good.size() - 16), "too short for the 1 rows of element \"face\""});
    }
    return cases;
}

TEST(Ply, ErrorsOfMalformedFilesNameTheFile) {
    std::vector<Malformed> cases = malformedHeaders();
    for (const auto& more : {malformedBodies(), malformedBinary()})
        cases.insert(cases.end(), more.begin(), more.end());
    for (const Malformed& c : cases) {
        try {
            parse(c.text);
            ADD_FAILURE() << "no error; expected: " << c.message << "\n" << c.text;
        } catch (const Error& error) {
            const std::string what = error.what();
            EXPECT_NE(what.find(c.message), std::string::npos)
                << "message: " << what << "\nexpected: " << c.message;
            EXPECT_EQ(what.rfind("\"test.ply\": ", 0), 0u) << what;
        }
    }
}

TEST(Ply, EveryTruncationIsAnError) {
    for (const Encoding e : kEncodings) {
        const std::string text = square<uint8_t, int32_t>(e, "uchar", "int");
        // An ASCII file is complete without its last byte, a line break.
        for (size_t n = 0; n + 1 < text.size(); ++n)
            EXPECT_THROW(parse(text.substr(0, n)), Error) << "cut to " << n << " of " << text.size();
    }
}

TEST(Ply, FilesWithFlippedBytesAreValidOrErrors) {
    for (const Encoding e : kEncodings) {
        const std::string good = square<uint8_t, int32_t>(e, "uchar", "int");
        for (size_t i = 0; i < good.size(); ++i) {
            for (const int flip : {1, 0x10, 0x80, 0xff}) {
                std::string text = good;
                text[i] = static_cast<char>(text[i] ^ flip);
                try {
                    const PlyMesh mesh = parse(text);
                    for (const uint32_t v : mesh.indices)
                        ASSERT_LT(v, mesh.positions.size());
                } catch (const Error&) {
                }
            }
        }
    }
}

/// A file that is removed by the destructor.
class TemporaryFile {
  public:
    TemporaryFile(const std::string& name, const std::string& contents)
        : path(std::filesystem::temp_directory_path() /
               (std::to_string(reinterpret_cast<uintptr_t>(this)) + "-strobe-" + name)) {
        std::ofstream(path, std::ios::binary) << contents;
    }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;
    ~TemporaryFile() { std::filesystem::remove(path); }
    const std::filesystem::path path;
};

ShapeParams withFiles(const std::vector<std::filesystem::path>& paths) {
    std::vector<std::string> names(paths.begin(), paths.end());
    return ShapeParams().strings("filename", names);
}

TEST(PlyMesh, ReadsAFile) {
    const TemporaryFile file("one.ply", square<uint8_t, int32_t>(Encoding::Big, "uchar", "int"));
    const Shape shape = makeShape(plyMeshPlugin(), withFiles({file.path}));
    ASSERT_TRUE(shape.mesh);
    EXPECT_EQ(shape.mesh->triangleCount(), 3u);
    EXPECT_EQ(shape.mesh->uvs.size(), 4u);
    EXPECT_EQ(shape.mesh->normals.at(0).size(), 4u);
    EXPECT_FALSE(shape.mesh->deforms());
}

TEST(PlyMesh, SeveralFilesAreKeys) {
    const std::string first = ascii("3", kXyz, "1", kList, std::string(kThree) + "3 0 1 2\n");
    const std::string second = ascii("3", kXyz, "1", kList, "0 0 1 1 0 1 0 1 1\n3 0 1 2\n");
    const TemporaryFile a("a.ply", first), b("b.ply", second);
    const TriangleMesh mesh = *makeShape(plyMeshPlugin(), withFiles({a.path, b.path, a.path}), {0, 2}).mesh;
    ASSERT_EQ(mesh.positions.size(), 3u);
    EXPECT_EQ(mesh.positions[1][1], V3f(1, 0, 1));
    EXPECT_EQ(mesh.keyTimes, (std::vector<float>{0, 1, 2}));
    EXPECT_TRUE(mesh.normals.empty());
}

TEST(PlyMesh, ErrorsHaveLocations) {
    const std::string one = ascii("3", kXyz, "1", kList, std::string(kThree) + "3 0 1 2\n");
    const TemporaryFile good("good.ply", one);
    const TemporaryFile quad("quad.ply", square<uint8_t, int32_t>(Encoding::Ascii, "uchar", "int"));
    const TemporaryFile other("other.ply", ascii("3", kXyz, "1", kList, std::string(kThree) + "3 0 2 1\n"));
    const TemporaryFile nan("nan.ply", ascii("3", kXyz, "1", kList, "0 0 0 0 nan 0 1 0 0 3 0 1 2\n"));
    const TemporaryFile huge("huge.ply", ascii("3", kXyz, "1", kList, "0 0 0 0 1e60 0 1 0 0 3 0 1 2\n"));
    const TemporaryFile empty("empty.ply", "");
    const Plugin<Shape> plugin = plyMeshPlugin();
    expectShapeError(plugin, ShapeParams(), "", "\"filename\" is missing");
    expectShapeError(plugin, withFiles({}), "filename", "names no file");
    expectShapeError(plugin, withFiles({"no such file.ply"}), "filename", "no such file.ply");
    expectShapeError(plugin, withFiles({empty.path}), "filename", empty.path.string());
    expectShapeError(plugin, withFiles({good.path.parent_path()}), "filename",
                     good.path.parent_path().string());
    expectShapeError(plugin, withFiles({nan.path}), "filename", "the position of vertex 1 is not finite");
    expectShapeError(plugin, withFiles({huge.path}), "filename", "the position of vertex 1 is not finite");
    expectShapeError(plugin, withFiles({good.path, quad.path}), "filename", "4 vertices instead of 3");
    expectShapeError(plugin, withFiles({good.path, other.path}), "filename", "the faces differ");
    expectShapeError(plugin, withFiles({good.path, good.path}).floats("keytimes", {1, 0}), "keytimes",
                     "ascending");
}

TEST(PlyMesh, LenientFilesMayBeEmptyOrHaveInvalidNormals) {
    const TemporaryFile none("none.ply", ascii("0", kXyz, "0", kList, ""));
    const TemporaryFile nan(
        "nan.ply", ascii("3", std::string(kXyz) + "property float nx\nproperty float ny\nproperty float nz\n",
                         "1", kList, "0 0 0 nan 0 0 1 0 0 0 0 1 0 1 0 0 0 1 3 0 1 2\n"));
    for (const bool lenient : {false, true}) {
        std::string warning;
        Diagnostics diagnostics([&](const std::string& text) { warning = text; });
        BuildContext context{diagnostics};
        context.isLenient = lenient;
        const auto make = [&](const TemporaryFile& file) {
            return plyMeshPlugin().create(withFiles({file.path}).set(), context);
        };
        if (!lenient) {
            EXPECT_THROW(make(none), Error);
            EXPECT_THROW(make(nan), Error);
            continue;
        }
        EXPECT_FALSE(make(none).mesh);
        EXPECT_NE(warning.find("a mesh without triangles is ignored"), std::string::npos);
        const Shape shape = make(nan);
        EXPECT_EQ(shape.mesh->normals[0][0], V3f(0));
        EXPECT_EQ(shape.mesh->normals[0][1], V3f(0, 0, 1));
        EXPECT_NE(warning.find("some normals are not finite; geometric normals are used instead"),
                  std::string::npos);
    }
}

TEST(PlyMesh, TrailingBytesAreIgnoredWithAWarning) {
    const TemporaryFile file("tail.ply", ascii("3", kXyz, "1", kList, std::string(kThree) + "3 0 1 2 7\n"));
    std::string warning;
    Diagnostics diagnostics([&](const std::string& text) { warning = text; });
    makeShape(plyMeshPlugin(), withFiles({file.path}), {0, 1}, &diagnostics);
    EXPECT_NE(warning.find("after the last element"), std::string::npos);
}

} // namespace
} // namespace strobe
