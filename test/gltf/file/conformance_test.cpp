// Deviations from the glTF specification that do not prevent reading a file.
#include "gltf/file/conformance.h"

#include "gltf/file/data_check.h"
#include "gltf/file/document.h"
#include "support/gltf_file.h"

#include <gtest/gtest.h>

#include <functional>

namespace strobe::test {
namespace {

/// Returns a document that conforms to glTF, with a textured triangle, a camera, a skin and an animation.
json conforming() {
    GltfFile file;
    const int positions = file.addFloats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    const int uvs = file.addFloats({0, 0, 1, 0, 0, 1}, "VEC2");
    const int joints = file.add(std::vector<uint8_t>(12, 0), "VEC4", UByte);
    const int weights = file.addFloats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
    const int indices = file.add(std::vector<uint16_t>{0, 1, 2}, "SCALAR", UShort);
    const int mesh = file.addMesh({{"attributes",
                                    {{"POSITION", positions},
                                     {"NORMAL", positions},
                                     {"TEXCOORD_0", uvs},
                                     {"JOINTS_0", joints},
                                     {"WEIGHTS_0", weights}}},
                                   {"indices", indices},
                                   {"material", 0}});
    const int joint = file.addNode({{"name", "joint"}}, false);
    file.addNode({{"mesh", mesh}, {"skin", 0}, {"children", {joint}}});
    file.root["skins"] = {{{"joints", {joint}}}};
    file.root["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", .8}, {"znear", .1}}}}};
    file.root["images"] = {{{"uri", "a.png"}}};
    file.root["textures"] = {{{"source", 0}}};
    file.root["materials"] = {{{"normalTexture", {{"index", 0}}},
                               {"extensions", {{"KHR_materials_volume", {{"thicknessFactor", 1}}}}}}};
    file.animate("move", joint, "translation", {0, 1}, {0, 0, 0, 1, 0, 0}, "VEC3");
    return json::parse(file.text());
}

/// Expects exactly this deviation after a change of the document.
void expect(const std::string& deviation, const std::function<void(json&)>& change) {
    json root = conforming();
    change(root);
    const gltf::Deviations found = gltf::findDeviations(json::parse(root.dump())); // unsigned numbers
    std::string text;
    for (const auto& [jsonPath, message] : found)
        text += (text.empty() ? "" : "; ") + jsonPath + ": " + message;
    EXPECT_EQ(text, deviation);
}

TEST(GltfConformance, AConformingDocumentHasNoDeviations) {
    expect("", [](json&) {});
}

TEST(GltfConformance, ReferencesOfUnusedItems) {
    expect("materials[0].normalTexture.index: there is no item 4 in textures, which has 1",
           [](json& r) { r["materials"][0]["normalTexture"]["index"] = 4; });
    expect("skins[0].joints[1]: occurs twice", [](json& r) { r["skins"][0]["joints"] = {0, 0}; });
    expect("scenes[0].nodes: node 0 is a child of another node", [](json& r) {
        r["scenes"][0]["nodes"] = {1, 0};
    });
    expect("samplers: must not be empty", [](json& r) { r["samplers"] = json::array(); });
}

TEST(GltfConformance, Extensions) {
    expect("materials[0].extensions.KHR_materials_ior: is not in extensionsUsed", [](json& r) {
        r["materials"][0]["extensions"]["KHR_materials_ior"] = {{"ior", 1.5}};
    });
    expect("nodes[0].extensions.KHR_materials_volume: does not belong here", [](json& r) {
        r["nodes"][0]["extensions"]["KHR_materials_volume"] = {{"thicknessFactor", 1}};
    });
    expect("extensionsRequired: EXT_other is not in extensionsUsed",
           [](json& r) { r["extensionsRequired"] = {"EXT_other"}; });
    expect("materials[0].extensions.KHR_materials_volume.thicknessFactor: -1 is out of range",
           [](json& r) { r["materials"][0]["extensions"]["KHR_materials_volume"]["thicknessFactor"] = -1; });
}

TEST(GltfConformance, RangesAndRequirementsOfItems) {
    expect("cameras[0].perspective.zfar: must be greater than znear",
           [](json& r) { r["cameras"][0]["perspective"]["zfar"] = .1; });
    expect("nodes[1].rotation: is not a unit quaternion", [](json& r) {
        r["nodes"][1]["rotation"] = {0, 0, 0, 2};
    });
    expect("nodes[1]: must have either a matrix, or translation, rotation and scale", [](json& r) {
        r["nodes"][1]["scale"] = {1, 1, 1};
        r["nodes"][1]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    });
    expect("materials[0].alphaCutoff: needs the alphaMode MASK",
           [](json& r) { r["materials"][0]["alphaCutoff"] = .5; });
    expect("images[0].mimeType: \"image/gif\" is not image/png or image/jpeg",
           [](json& r) { r["images"][0]["mimeType"] = "image/gif"; });
    expect("accessors[0].normalized: must not be true for this componentType",
           [](json& r) { r["accessors"][0]["normalized"] = true; });
    expect("bufferViews[0]: exceeds its buffer",
           [](json& r) { r["bufferViews"][0]["byteLength"] = r["buffers"][0]["byteLength"].get<int>() + 1; });
}

TEST(GltfConformance, Primitives) {
    const auto attributes = [](json& r) -> json& { return r["meshes"][0]["primitives"][0]["attributes"]; };
    expect("meshes[0].primitives[0].material: needs TEXCOORD_0",
           [&](json& r) { attributes(r).erase("TEXCOORD_0"); });
    expect("meshes[0].primitives[0].attributes.SPEED: is not the name of an attribute",
           [&](json& r) { attributes(r)["SPEED"] = 0; });
    expect("meshes[0].primitives[0].attributes.NORMAL: must be of type VEC3",
           [&](json& r) { attributes(r)["NORMAL"] = 3; });
    expect("meshes[0].primitives[0].attributes.POSITION: needs min and max",
           [](json& r) { r["accessors"][0].erase("max"); });
}

TEST(GltfConformance, Animations) {
    expect("animations[0].channels[1]: animates the same property as another channel",
           [](json& r) { r["animations"][0]["channels"].push_back(r["animations"][0]["channels"][0]); });
    expect("animations[0].channels[0].sampler: there is no sampler 9",
           [](json& r) { r["animations"][0]["channels"][0]["sampler"] = 9; });
}

TEST(GltfConformance, LayoutOfBuffers) {
    expect("accessors[0].byteOffset: is not aligned to the size of a component; accessors[0]: exceeds its "
           "buffer view; "
           "accessors[0].byteOffset: must be a multiple of 4 for attributes",
           [](json& r) { r["accessors"][0]["byteOffset"] = 2; });
    expect("bufferViews[0]: has both indices and attributes",
           [](json& r) { r["bufferViews"][0]["target"] = 34963; });
    expect("accessors[0]: elements have 12 bytes, more than the byteStride",
           [](json& r) { r["bufferViews"][0]["byteStride"] = 4; });
    expect("bufferViews[0]: needs a byteStride, since several attributes use it", [](json& r) {
        r["accessors"].push_back(r["accessors"][0]);
        r["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = r["accessors"].size() - 1;
    });
}

class GltfData : public testing::Test {
  protected:
    /// Expects this deviation of the data of a file with a triangle, after a change.
    void expect(const std::string& deviation, const std::function<void(GltfFile&)>& change) {
        GltfFile file;
        file.addNode({{"mesh", file.addTriangle()}});
        change(file);
        const gltf::Document document(m_folder.write("data.gltf", file.text()), {});
        std::string text;
        for (const auto& [jsonPath, message] : gltf::findDataDeviations(document))
            text += (text.empty() ? "" : "; ") + jsonPath + ": " + message;
        EXPECT_EQ(text, deviation);
    }
    GltfFolder m_folder;
};

TEST_F(GltfData, NumbersOfAccessors) {
    expect("", [](GltfFile&) {});
    expect("accessors[0]: element 1 is outside of min and max", [](GltfFile& f) {
        f.root["accessors"][0]["max"] = {.5, 1, 0};
    });
    expect("", [](GltfFile& f) { f.root["accessors"][0]["max"] = {.99999, 1, 0}; }); // rounded
    expect("skins[0].inverseBindMatrices: the fourth row of a matrix is not (0, 0, 0, 1)", [](GltfFile& f) {
        const int matrix = f.addFloats({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2}, "MAT4");
        f.root["skins"] = {{{"joints", {0}}, {"inverseBindMatrices", matrix}}};
    });
    expect("meshes[0].primitives[0].attributes.COLOR_0: a color is not between 0 and 1", [](GltfFile& f) {
        f.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
            f.addFloats({0, 0, 0, 0, 2, 0, 0, 0, 0}, "VEC3");
    });
    expect("meshes[0].primitives[0].indices: index 3 is out of range", [](GltfFile& f) {
        f.root["meshes"][0]["primitives"][0]["indices"] =
            f.add(std::vector<uint16_t>{0, 1, 3}, "SCALAR", UShort);
    });
}

TEST_F(GltfData, Images) {
    m_folder.write("short.png", "\x89PNG\r\n\x1a\n");
    expect("images[0]: is not a PNG or JPEG image", [](GltfFile& f) {
        f.root["images"] = {{{"uri", "short.png"}}};
    });
    expect("images[0].uri: \"" + (m_folder.path() / "none.png").string() +
               "\" cannot be read; the textures with this image are ignored",
           [](GltfFile& f) {
               f.root["images"] = {{{"uri", "none.png"}}};
           });
}

/// Valid files that tinygltf refuses.
TEST_F(GltfData, RepairedFiles) {
    expect("", [](GltfFile& f) { f.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 0.; });
    expect("", [](GltfFile& f) { f.root["accessors"][0]["count"] = 3.; });
    expect("", [](GltfFile& f) {
        f.root["accessors"].push_back({{"componentType", 5123}, {"count", 3}, {"type", "SCALAR"}});
        f.root["meshes"][0]["primitives"][0]["indices"] = f.root["accessors"].size() - 1;
    });
    expect("", [](GltfFile& f) {
        f.root["accessors"].push_back({{"componentType", 5126}, {"count", 3}, {"type", "TENSOR"}});
    });
    expect("", [](GltfFile& f) { f.root["buffers"] = {{{"byteLength", 1000}}}; });
}

/// Objects, arrays, numbers and strings at the places of all members.
TEST(GltfConformance, AnyTypeOfAnyMemberIsNoCrash) {
    const json valid = conforming(), flat = valid.flatten();
    for (const auto& [pointer, ignored] : flat.items())
        for (const json& value : {json(), json(7), json("text"), json::array({1, "a"}), json{{"a", 1}}})
            for (json::json_pointer place(pointer); !place.empty(); place = place.parent_pointer()) {
                json root = valid;
                root[place] = value;
                EXPECT_NO_THROW(gltf::findDeviations(root)) << place.to_string() << " " << value;
            }
}

} // namespace
} // namespace strobe::test
