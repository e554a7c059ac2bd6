// Invalid glTF files: each is an Error that names the JSON path, and never a crash.
#include "gltf/import.h"
#include "support/gltf_file.h"

#include <gtest/gtest.h>

#include <functional>

namespace strobe::test {
namespace {

/// Returns a valid file with a skin, a morph target, a material and animations.
GltfFile validFile() {
    GltfFile file;
    const int positions = file.addFloats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    const int indices = file.add(std::vector<uint16_t>{0, 1, 2}, "SCALAR", UShort);
    const int joints = file.add(std::vector<uint8_t>(12, 0), "VEC4", UByte);
    const int weights = file.addFloats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
    const int mesh =
        file.addMesh({{"attributes", {{"POSITION", positions}, {"JOINTS_0", joints}, {"WEIGHTS_0", weights}}},
                      {"indices", indices},
                      {"material", 0},
                      {"targets", {{{"POSITION", file.addFloats({0, 0, 1, 0, 0, 0, 0, 0, 0}, "VEC3")}}}}});
    const int child = file.addNode({{"name", "joint"}}, false);
    const int node = file.addNode({{"mesh", mesh}, {"skin", 0}, {"children", {child}}});
    file.root["skins"] = {{{"joints", {child}}}};
    file.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 1}}}}}};
    file.animate("move", child, "translation", {0, 1}, {0, 0, 0, 1, 0, 0}, "VEC3");
    file.animate("move", node, "weights", {0, 1}, {0, 1}, "SCALAR");
    return file;
}

class GltfErrors : public testing::Test {
  protected:
    /// Returns the message of importing a file, without the file's name; empty: none.
    std::string messageOf(const std::string& bytes, const std::string& name = "wrong.gltf") {
        const auto path = m_folder.write(name, bytes);
        try {
            Diagnostics quiet;
            quiet.setStrict(true);
            const auto textures = std::make_shared<TextureCache>();
            gltf::Importer importer(gltf::open(path, {}), {}, *textures, quiet);
            const Shutter shutter{0, 1};
            importer.deformations(importer.motions(shutter), shutter);
        } catch (const Error& e) {
            const std::string what = e.what(), start = path.string() + ": ";
            EXPECT_EQ(what.substr(0, start.size()), start);
            return what.substr(std::min(start.size(), what.size()));
        }
        return "";
    }
    /// Expects a message for the valid file after a change.
    void expect(const std::string& message, const std::function<void(GltfFile&)>& change) {
        GltfFile file = validFile();
        change(file);
        EXPECT_EQ(messageOf(file.text()), message);
    }
    GltfFolder m_folder;
};

TEST_F(GltfErrors, TheValidFileHasNoError) { EXPECT_EQ(messageOf(validFile().text()), ""); }

TEST_F(GltfErrors, IndicesOutOfRange) {
    expect("nodes[1].mesh: there is no mesh 7; the file has 1",
           [](GltfFile& f) { f.root["nodes"][1]["mesh"] = 7; });
    expect("nodes[1].skin: there is no skin 1; the file has 1",
           [](GltfFile& f) { f.root["nodes"][1]["skin"] = 1; });
    expect("nodes[1].children[0]: there is no node 99; the file has 2",
           [](GltfFile& f) { f.root["nodes"][1]["children"] = {99}; });
    expect("nodes[1].children[0]: -1 is out of range",
           [](GltfFile& f) { f.root["nodes"][1]["children"] = {-1}; });
    expect("nodes[1].mesh: must be an integer", [](GltfFile& f) { f.root["nodes"][1]["mesh"] = 0.5; });
    expect("accessors[1].bufferView: 4294967296 is out of range",
           [](GltfFile& f) { f.root["accessors"][1]["bufferView"] = 4294967296; });
    expect("meshes[0].primitives[0].attributes.POSITION: there is no accessor 50; the file has 9",
           [](GltfFile& f) { f.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 50; });
    expect("meshes[0].primitives[0].material: there is no material 3; the file has 1",
           [](GltfFile& f) { f.root["meshes"][0]["primitives"][0]["material"] = 3; });
    expect("animations[0].channels[0].target.node: there is no node 20; the file has 2",
           [](GltfFile& f) { f.root["animations"][0]["channels"][0]["target"]["node"] = 20; });
    expect("scenes[0].nodes[0]: there is no node 8; the file has 2",
           [](GltfFile& f) { f.root["scenes"][0]["nodes"] = {8}; });
    expect("skins[0].joints[0]: there is no node 5; the file has 2",
           [](GltfFile& f) { f.root["skins"][0]["joints"] = {5}; });
    expect("scene: there is no scene 4; the file has 1", [](GltfFile& f) { f.root["scene"] = 4; });
}

TEST_F(GltfErrors, AccessorsOutOfRange) {
    const std::string positions = "meshes[0].primitives[0].attributes.POSITION (accessors[0])";
    expect(positions + ": 4000000000 elements exceed bufferViews[0], which has room for 3",
           [](GltfFile& f) { f.root["accessors"][0]["count"] = 4000000000; });
    expect(positions + ": 3 elements exceed bufferViews[0], which has room for 2",
           [](GltfFile& f) { f.root["accessors"][0]["byteOffset"] = 4; });
    expect(positions + ": 3 elements exceed bufferViews[0], which has room for 0",
           [](GltfFile& f) { f.root["accessors"][0]["byteOffset"] = 4294967290; });
    expect("accessors[0].byteOffset: 18446744073709551615 is out of range",
           [](GltfFile& f) { f.root["accessors"][0]["byteOffset"] = 18446744073709551615u; });
    expect("bufferViews[0]: 36 bytes at offset 99999 exceed buffers[0] of " +
               std::to_string(validFile().bytes().size()) + " bytes",
           [](GltfFile& f) { f.root["bufferViews"][0]["byteOffset"] = 99999; });
    expect(positions + ": byteStride 4 is less than the size of an element, 12",
           [](GltfFile& f) { f.root["bufferViews"][0]["byteStride"] = 4; });
    expect(positions + ": has 2 components instead of 3",
           [](GltfFile& f) { f.root["accessors"][0]["type"] = "VEC2"; });
    expect("meshes[0].primitives[0].attributes.WEIGHTS_0 (accessors[3]): has 2 elements instead of 3",
           [](GltfFile& f) { f.root["accessors"][3]["count"] = 2; });
    expect(
        "meshes[0].primitives[0].indices (accessors[1]): must have unsigned integers that are not normalized",
        [](GltfFile& f) { f.root["accessors"][1]["componentType"] = 5122; });
    expect("meshes[0].primitives[0].attributes.POSITION (accessors[0]): unknown componentType 5124",
           [](GltfFile& f) { f.root["accessors"][0]["componentType"] = 5124; });
    expect("meshes[0].primitives[0].indices: index 65535 (number 1) is out of range: the primitive has 3 "
           "vertices",
           [](GltfFile& f) {
               f.root["accessors"][1]["bufferView"] = f.addView(std::vector<uint16_t>{0, 65535, 2});
           });
    expect("meshes[0].primitives[0].attributes.JOINTS_0: joint 9 is out of range: the skin has 1 joints",
           [](GltfFile& f) {
               f.root["accessors"][2]["bufferView"] =
                   f.addView(std::vector<uint8_t>{9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
           });
    expect(positions + ": element 1 is not finite", [](GltfFile& f) {
        const float nan = std::numeric_limits<float>::quiet_NaN();
        f.root["accessors"][0]["bufferView"] = f.addView(std::vector<float>{0, 0, 0, 1, nan, 0, 0, 1, 0});
    });
    expect(positions + ".sparse.indices: index 3 is out of range: the accessor has 3 elements",
           [](GltfFile& f) {
               f.root["accessors"][0]["sparse"] = {
                   {"count", 1},
                   {"indices", {{"bufferView", f.addView(std::vector<uint8_t>{3})}, {"componentType", 5121}}},
                   {"values", {{"bufferView", f.addView(std::vector<float>{1, 2, 3})}}}};
           });
    expect(positions + ": 4000000000 elements without a bufferView", [](GltfFile& f) {
        f.root["accessors"][0].erase("bufferView");
        f.root["accessors"][0]["count"] = 4000000000;
    });
    expect("meshes[0].primitives[0]: the number of indices, 2, is not a multiple of 3",
           [](GltfFile& f) { f.root["accessors"][1]["count"] = 2; });
}

TEST_F(GltfErrors, NodesThatAreNoTree) {
    expect("nodes[0]: is part of a cycle of nodes", [](GltfFile& f) {
        f.root["nodes"][0]["children"] = {0};
        f.root["nodes"][1]["children"] = json::array();
    });
    expect("nodes[0]: is part of a cycle of nodes",
           [](GltfFile& f) { f.root["nodes"][0]["children"] = {1}; });
    expect("nodes[1].children[1]: node 0 is already a child of node 1", [](GltfFile& f) {
        f.root["nodes"][1]["children"] = {0, 0};
    });
    expect("scenes[0].nodes[1]: node 1 is in the scene twice", [](GltfFile& f) {
        f.root["scenes"][0]["nodes"] = {1, 1};
    });
    expect("nodes[1001]: is more than 1000 levels deep", [](GltfFile& f) {
        f.root["nodes"] = json::array();
        f.root.erase("animations");
        f.root["skins"][0]["joints"] = {0};
        for (int i = 0; i < 1500; ++i)
            f.root["nodes"].push_back({{"children", {i + 1}}});
        f.root["nodes"].push_back({{"name", "last"}});
        f.root["scenes"][0]["nodes"] = {0};
    });
}

TEST_F(GltfErrors, InvalidNumbers) {
    expect("nodes[0].translation[0]: the number does not fit a 32-bit float", [](GltfFile& f) {
        f.root["nodes"][0]["translation"] = {1e99, 0, 0};
    });
    expect("nodes[0].translation: must be three numbers", [](GltfFile& f) {
        f.root["nodes"][0]["translation"] = {1, 2};
    });
    expect("nodes[0].rotation: is not a unit quaternion", [](GltfFile& f) {
        f.root["nodes"][0]["rotation"] = {0, 0, 0, 0};
    });
    expect(R"(materials[0].alphaMode: unknown "HALF" (known: OPAQUE, MASK, BLEND))",
           [](GltfFile& f) { f.root["materials"][0]["alphaMode"] = "HALF"; });
    expect("animations[0].samplers[0].input: times must ascend, but do not at key 1", [](GltfFile& f) {
        const int input = f.root["animations"][0]["samplers"][0]["input"];
        f.root["accessors"][input]["bufferView"] = f.addView(std::vector<float>{1, 1});
    });
    expect("animations[0].samplers[0].output (accessors[6]): has 2 elements instead of 6",
           [](GltfFile& f) { f.root["animations"][0]["samplers"][0]["interpolation"] = "CUBICSPLINE"; });
}

TEST_F(GltfErrors, UnsupportedFeatures) {
    expect("extensionsRequired: unsupported extensions: KHR_draco_mesh_compression: the meshes "
           "are compressed by Draco; export without compression, or decompress them first; MINE_x",
           [](GltfFile& f) {
               f.root["extensionsRequired"] = {"KHR_draco_mesh_compression", "MINE_x"};
           });
    expect("asset.version: this is glTF 1.0; only 2.0 is supported",
           [](GltfFile& f) { f.root["asset"]["version"] = "1.0"; });
    expect("", [](GltfFile& f) { f.root["extensionsUsed"] = {"MINE_x"}; });
    expect("asset.version: is missing: this is not a glTF 2.0 file",
           [](GltfFile& f) { f.root.erase("asset"); });
}

TEST_F(GltfErrors, FilesOutsideTheFolderAreNotRead) {
    m_folder.write("secret", "x");
    for (const std::string uri : {"/etc/passwd", "../secret", "a/../../secret", "%2e%2e/secret"})
        expect(R"(buffers[0].uri: ")" + (uri[0] == '%' ? "../secret" : uri) +
                   R"(" is outside the folder of the file)",
               [&](GltfFile& f) {
                   f.root["buffers"] = {{{"byteLength", 1}, {"uri", uri}}};
               });
    expect("buffers[0].uri: is not a file name", [](GltfFile& f) {
        f.root["buffers"] = {{{"byteLength", 1}, {"uri", "http://x.y/z"}}};
    });
    expect(R"(images[0].uri: "../secret" is outside the folder of the file)", [](GltfFile& f) {
        f.root["images"] = {{{"uri", "../secret"}}};
    });
}

TEST_F(GltfErrors, InvalidImages) {
    const auto useImage = [](GltfFile& f, const json& image) {
        f.root["images"] = {image};
        f.root["textures"] = {{{"source", 0}}};
        f.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    };
    expect("images[0]: is neither a PNG nor a JPEG image", [&](GltfFile& f) {
        useImage(f, {{"bufferView", f.addView(std::vector<uint8_t>(40, 7))}, {"mimeType", "image/png"}});
    });
    expect("images[0].bufferView: there is no bufferView 70; the file has 9", [&](GltfFile& f) {
        useImage(f, {{"bufferView", 70}, {"mimeType", "image/png"}});
    });
    expect(R"(images[0].uri: ")" + (m_folder.path() / "missing.png").string() +
               R"(" cannot be read; the textures with this image are ignored)",
           [&](GltfFile& f) {
               useImage(f, {{"uri", "missing.png"}});
           });
    expect("textures[0].source: there is no image 6; the file has 1", [&](GltfFile& f) {
        useImage(f, {{"uri", "missing.png"}});
        f.root["textures"][0]["source"] = 6;
    });
    GltfFile truncated = validFile(); // a PNG without data after its header
    useImage(truncated, {{"bufferView",
                          truncated.addView(std::vector<uint8_t>{0x89, 'P', 'N', 'G', 13, 10, 26, 10, 0, 0})},
                         {"mimeType", "image/png"}});
    const auto path = m_folder.write("cut.gltf", truncated.text());
    const auto textures = std::make_shared<TextureCache>();
    Diagnostics quiet;
    try {
        gltf::Importer(gltf::open(path, {}), {}, *textures, quiet);
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(std::string(e.what()).find("cannot read the image " + path.string() + ": images[0]: "), 0u)
            << e.what();
    }
}

TEST_F(GltfErrors, MissingBuffers) {
    const auto withBuffer = [&](const json& buffer) {
        return [=](GltfFile& f) { f.root["buffers"] = {buffer}; };
    };
    expect("buffers[0]: has no uri: its bytes are taken as zeros", withBuffer({{"byteLength", 9}}));
    expect("buffers[0].uri: is not base64",
           withBuffer({{"byteLength", 9}, {"uri", "data:application/octet-stream;base64,?!"}}));
    expect("buffers[0].byteLength: is 9, but the data has 3 bytes",
           withBuffer({{"byteLength", 9}, {"uri", "data:application/octet-stream;base64,AAAA"}}));
    expect(R"(buffers: ")" + (m_folder.path() / "x.bin").string() + R"(" cannot be read)",
           withBuffer({{"byteLength", 9}, {"uri", "x.bin"}}));
    m_folder.write("x.bin", "1234");
    expect(R"(buffers: ")" + (m_folder.path() / "x.bin").string() + R"(" has 4 of 9 bytes)",
           withBuffer({{"byteLength", 9}, {"uri", "x.bin"}}));
    expect("images[0]: must have either a uri or a bufferView",
           [](GltfFile& f) { f.root["images"] = {json::object()}; });
    expect("bufferViews[0].byteStride: 3 is not a multiple of 4 up to 252",
           [](GltfFile& f) { f.root["bufferViews"][0]["byteStride"] = 3; });
}

TEST_F(GltfErrors, InvalidJson) {
    EXPECT_EQ(messageOf(""), "the file is empty");
    EXPECT_EQ(messageOf("[1]"), "the file's JSON is not an object");
    EXPECT_NE(messageOf(R"({"asset": )").find("invalid JSON: parse error"), std::string::npos);
    std::string deep = R"({"extras":)";
    for (int i = 0; i < 100000; ++i)
        deep += "[";
    EXPECT_EQ(messageOf(deep), "the JSON is nested more than 128 deep");
}

TEST_F(GltfErrors, TruncatedAndDamagedBinaryFiles) {
    const std::string whole = validFile().binary();
    EXPECT_EQ(messageOf(whole, "whole.glb"), "");
    for (size_t length = 4; length < whole.size(); length += length < 40 ? 1 : 37)
        EXPECT_NE(messageOf(whole.substr(0, length), "cut.glb"), "") << length;
    EXPECT_EQ(messageOf(whole.substr(0, 300), "cut.glb"),
              "the file is truncated: it has 300 of " + std::to_string(whole.size()) + " bytes");
    // Random bytes are replaced: sanitizers detect invalid reads.
    uint32_t state = 1;
    for (int i = 0; i < 300; ++i) {
        std::string damaged = whole;
        for (int k = 0; k < 4; ++k) {
            state = state * 1664525u + 1013904223u;
            damaged[state % whole.size()] = char(state >> 13);
        }
        messageOf(damaged, "damaged.glb");
    }
}

} // namespace
} // namespace strobe::test
