// Renders scenes with glTF files.
#include "support/gltf_file.h"
#include "support/render_text.h"

#include <gtest/gtest.h>

namespace strobe::test {
namespace {

class GltfScenes : public testing::Test {
  protected:
    BuiltScene build(const std::string& scene, const BuildOptions& options = {}) {
        Diagnostics diagnostics([this](const std::string& text) { m_warnings.push_back(text); });
        const auto path = m_folder.write("test.scene", scene);
        return buildScene(parseFiles({path}, {"supersample"}, diagnostics), options, diagnostics);
    }
    BuiltScene buildFile(const GltfFile& file, const BuildOptions& options = {}) {
        Diagnostics diagnostics([this](const std::string& text) { m_warnings.push_back(text); });
        const auto path = m_folder.write("model.gltf", file.text());
        return buildScene(parseFiles({path}, {"supersample"}, diagnostics), options, diagnostics);
    }
    /// Returns a square of side 2 about the origin, facing +z, with material 0.
    static GltfFile square() {
        GltfFile file;
        file.addNode(
            {{"mesh",
              file.addMesh({{"attributes",
                             {{"POSITION", file.addFloats({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, "VEC3")},
                              {"TEXCOORD_0", file.addFloats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2")}}},
                            {"indices", file.add(std::vector<uint8_t>{0, 1, 2, 0, 2, 3}, "SCALAR", UByte)},
                            {"material", 0}})}});
        file.root["materials"] = {json::object()};
        return file;
    }
    /// Adds an orthographic camera at (0,0,5) that looks along -z at x and y from -1 to 1.
    static void addCamera(GltfFile& file) {
        file.root["cameras"] = {{{"type", "orthographic"},
                                 {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0}, {"zfar", 9}}}}};
        file.addNode({{"camera", 0}, {"translation", {0, 0, 5}}});
    }
    /// Adds a light without intensity, which prevents the default sky.
    static void addBlackLight(GltfFile& file) {
        file.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", 0}}};
        file.addNode({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    }
    static BuildOptions small() {
        BuildOptions options;
        options.resolution = V2i(8, 8);
        options.samplesPerPixel = 4;
        return options;
    }
    /// Writes an image of four colors, red and green above, blue and white below; returns its name.
    std::string writeQuarters() const {
        Image image{2, 2, {Rgb(1, 0, 0), Rgb(0, 1, 0), Rgb(0, 0, 1), Rgb(1, 1, 1)}};
        writeImage(m_folder.path() / "quarters.png", image, {});
        return "quarters.png";
    }
    static void addTexture(GltfFile& file, const std::string& image) {
        file.root["images"] = {{{"uri", image}}};
        file.root["samplers"] = {{{"magFilter", 9728}, {"wrapS", 33071}, {"wrapT", 33071}}};
        file.root["textures"] = {{{"source", 0}, {"sampler", 0}}};
    }
    static void expectQuarters(const Image& image, const Rgb& topLeft, const Rgb& topRight,
                               const Rgb& bottomLeft, const Rgb& bottomRight) {
        const auto expectNear = [&](int x, int y, const Rgb& c) {
            for (int k = 0; k < 3; ++k)
                EXPECT_NEAR(image.at(x, y)[k], c[k], 1e-3f) << x << " " << y;
        };
        expectNear(1, 1, topLeft);
        expectNear(6, 1, topRight);
        expectNear(1, 6, bottomLeft);
        expectNear(6, 6, bottomRight);
    }

    GltfFolder m_folder;
    std::vector<std::string> m_warnings;
};

const Rgb kRed(1, 0, 0), kGreen(0, 1, 0), kBlue(0, 0, 1), kWhite(1, 1, 1);

TEST_F(GltfScenes, UnlitTexturesKeepTheirColors) {
    GltfFile file = square();
    addCamera(file);
    addTexture(file, writeQuarters());
    json& material = file.root["materials"][0];
    material["extensions"]["KHR_materials_unlit"] = json::object();
    material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    expectQuarters(render(buildFile(file, small())).image, kRed, kGreen, kBlue, kWhite);
    // The rotation of coordinates by 90 degrees counter-clockwise rotates the image clockwise.
    material["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"] = {
        {"rotation", kPi / 2}, {"offset", {0, 1}}};
    expectQuarters(render(buildFile(file, small())).image, kBlue, kRed, kWhite, kGreen);
    material["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"] = {
        {"scale", {-1, 1}}, {"offset", {1, 0}}};
    expectQuarters(render(buildFile(file, small())).image, kGreen, kRed, kWhite, kBlue);
}

TEST_F(GltfScenes, VertexColorsAndSecondSetOfTextureCoordinates) {
    GltfFile file = square();
    addCamera(file);
    addTexture(file, writeQuarters());
    json& attributes = file.root["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_1"] = file.addFloats({1, 1, 0, 1, 0, 0, 1, 0}, "VEC2"); // u is mirrored
    attributes["COLOR_0"] =
        file.add(std::vector<uint8_t>{255, 255, 0, 9, 255, 255, 0, 9, 255, 255, 0, 9, 255, 255, 0, 9}, "VEC4",
                 UByte, true);
    json& material = file.root["materials"][0];
    material["extensions"]["KHR_materials_unlit"] = json::object();
    material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}, {"texCoord", 1}};
    expectQuarters(render(buildFile(file, small())).image, kGreen, kRed, Rgb(1, 1, 0), Rgb(0));
    // Base color uses the first set, so that emission needs the second set besides the mesh's.
    addBlackLight(file);
    material = {{"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", {{"index", 0}, {"texCoord", 1}}}};
    material["pbrMetallicRoughness"] = {{"baseColorFactor", {0, 0, 0, 1}},
                                        {"baseColorTexture", {{"index", 0}}}};
    expectQuarters(render(buildFile(file, small())).image, kGreen, kRed, kWhite, kBlue);
}

TEST_F(GltfScenes, AlphaModes) {
    GltfFile file = square();
    addCamera(file);
    addBlackLight(file);
    json& material = file.root["materials"][0];
    material["extensions"]["KHR_materials_unlit"] = json::object();
    material["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, .4};
    BuildOptions options = small();
    options.samplesPerPixel = 64;
    const auto meanWith = [&](const char* mode) {
        material["alphaMode"] = mode;
        double sum = 0;
        const Image image = render(buildFile(file, options)).image;
        for (const Rgb& p : image.pixels)
            sum += p.x;
        return sum / double(image.pixels.size());
    };
    EXPECT_EQ(meanWith("OPAQUE"), 1);
    EXPECT_NEAR(meanWith("BLEND"), .4, .03); // 4096 samples: five standard deviations
    EXPECT_EQ(meanWith("MASK"), 0);
    material["alphaCutoff"] = .3;
    EXPECT_EQ(meanWith("MASK"), 1);
}

TEST_F(GltfScenes, DefaultViewIsNotMirrored) {
    GltfFile file = square();
    file.root["materials"][0]["pbrMetallicRoughness"] = {{"baseColorFactor", {0, 0, 0, 1}},
                                                         {"metallicFactor", 0}};
    // A lamp on the right (+x in glTF).
    json lamp = file.root["meshes"][0]["primitives"][0];
    lamp["material"] = 1;
    file.root["materials"].push_back(
        {{"emissiveFactor", {1, 1, 1}},
         {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 5}}}}},
         {"doubleSided", true}});
    file.root["meshes"].push_back({{"primitives", {lamp}}});
    file.addNode({{"mesh", 1}, {"translation", {3, 0, 0}}});
    addBlackLight(file); // emission alone does not remove the studio
    const Image image = render(buildFile(file, small())).image;
    double left = 0, right = 0;
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x)
            (x < 4 ? left : right) += image.at(x, y).x;
    EXPECT_GT(right, 10);
    EXPECT_LT(left, .2 * right);
}

TEST_F(GltfScenes, IncludeAndShapeAddFilesToScenes) {
    GltfFile file = square();
    file.root["materials"][0]["extensions"]["KHR_materials_unlit"] = json::object();
    m_folder.write("model.gltf", file.text());
    const std::string before =
        R"(LookAt 0 0 5  0 0 0  0 1 0 Camera "orthographic" "float screenwindow" [-1 1 -1 1] Film "image" "integer xresolution" 8 "integer yresolution" 8
WorldBegin )";
    const auto center = [&](const std::string& world) {
        return render(build(before + world, small())).image.at(4, 4).x;
    };
    EXPECT_EQ(center(R"(Include "model.gltf")"), 1);
    EXPECT_EQ(center(R"(Translate 9 0 0 Include "model.gltf" LightSource "point")"), 0);
    EXPECT_EQ(center(R"(Shape "gltf" "string filename" "model.gltf")"), 1);
    EXPECT_EQ(center(R"(ObjectBegin "o" Include "model.gltf" ObjectEnd ObjectInstance "o")"), 1);
    EXPECT_EQ(center(R"(ObjectBegin "o" Include "model.gltf" ObjectEnd LightSource "point")"), 0);
    for (const auto& [world, message] :
         {std::pair{R"(Shape "gltf" "string filenam" "model.gltf")", R"(parameter "filename" is missing)"},
          {R"(Shape "gltf" "string filename" "model.gltf" "bool light" true)", "unknown parameter"},
          {R"(Shape "gltf" "string filename" "model.gltf" "string animation" "Run")",
           R"(there is no animation "Run")"}})
        try {
            build(before + world, small());
            ADD_FAILURE() << world;
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(message), std::string::npos) << e.what();
            EXPECT_TRUE(e.location);
        }
}

TEST_F(GltfScenes, FramesShowTheAnimationAtTheirTime) {
    GltfFile file = square();
    addCamera(file);
    addBlackLight(file);
    file.root["materials"][0]["extensions"]["KHR_materials_unlit"] = json::object();
    file.animate("a", 0, "translation", {0, 1}, {0, 0, 0, 2, 0, 0}, "VEC3"); // to the right, out of the frame
    Diagnostics quiet;
    const auto path = m_folder.write("model.gltf", file.text());
    BuildOptions options = small();
    options.samplesPerPixel = 256;
    SceneBuilder builder(parseFiles({path}, {"supersample"}, quiet), options, quiet);
    for (const float time : {0.f, .5f, 1.f, .25f}) {
        const Image image = render(builder.build({time, time})).image;
        for (int x = 0; x < 8; ++x)
            EXPECT_EQ(image.at(x, 3).x, float(x) / 4 >= 2 * time) << time << " " << x;
    }
    // From time 0 to 1 the left edge of the square crosses the frame.
    const Image blurred = render(builder.build({0, 1})).image;
    for (int x = 0; x < 8; ++x)
        EXPECT_NEAR(blurred.at(x, 3).x, (float(x) + .5f) / 8, .03f);
}

TEST_F(GltfScenes, TheStudioLightsFilesWithoutLightsOfTheirOwn) {
    GltfFile file = square();
    EXPECT_FALSE(buildFile(file, small()).isLitByGltf);
    const Image image = render(buildFile(file, small())).image;
    for (const Rgb& c : image.pixels)
        EXPECT_GT(luminance(c), .05f);
    // Emission alone does not remove it.
    file.root["materials"][0]["emissiveFactor"] = {1, 1, 1};
    EXPECT_GT(luminance(render(buildFile(file, small())).image.pixels[0]), .05f);
    file.root["materials"][0].erase("emissiveFactor");
    addBlackLight(file);
    EXPECT_TRUE(buildFile(file, small()).isLitByGltf);
    EXPECT_EQ(render(buildFile(file, small())).image.pixels[0], Rgb(0));
}

TEST_F(GltfScenes, TheDefaultViewIsTight) {
    GltfFile file = square();
    file.root["materials"][0] = {{"extensions", {{"KHR_materials_unlit", json::object()}}}};
    addBlackLight(file);
    BuildOptions options = small();
    options.resolution = V2i(64, 48);
    options.samplesPerPixel = 16;
    const Image image = render(buildFile(file, options)).image;
    int left = 64, right = 0, top = 48, bottom = 0;
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x)
            if (image.at(x, y).x > .01f) {
                left = std::min(left, x);
                right = std::max(right, x);
                top = std::min(top, y);
                bottom = std::max(bottom, y);
            }
    const int margin = std::min({left, 63 - right, top, 47 - bottom});
    EXPECT_GE(margin, 1);
    EXPECT_LE(margin, 3); // 8 % of half the height are left free
}

TEST_F(GltfScenes, TheGroundLiesBelowTheFile) {
    GltfFile file = square();
    BuildOptions options = small();
    options.gltfGround = true;
    options.resolution = V2i(32, 32);
    const BuiltScene built = buildFile(file, options);
    EXPECT_EQ(built.scene->tracer().counts().quadrics, 1u);
    EXPECT_EQ(built.materialNames.back().find("ground"), 0u);
}

TEST_F(GltfScenes, PanesBehindPanesAreNotBlack) {
    GltfFile file = square();
    file.root["materials"][0] = {
        {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0}}},
        {"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 1}}}}}};
    for (int i = 1; i < 10; ++i)
        file.addNode({{"mesh", 0}, {"translation", {0, 0, -.1 * i}}});
    addCamera(file);
    const float light = luminance(render(buildFile(file, small())).image.at(4, 4));
    EXPECT_GT(light, .1f);
    BuildOptions counted = small();
    counted.defines = {"transparentdepth=0"};
    EXPECT_LT(luminance(render(buildFile(file, counted)).image.at(4, 4)), .5f * light);
}

TEST_F(GltfScenes, VolumesAbsorbByDistance) {
    // Two squares, 2 apart, that face outwards: a slab. No reflection: the index is 1.
    GltfFile file = square();
    file.root["materials"][0] = {
        {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0}}},
        {"extensions",
         {{"KHR_materials_ior", {{"ior", 1}}},
          {"KHR_materials_transmission", {{"transmissionFactor", 1}}},
          {"KHR_materials_volume",
           {{"thicknessFactor", 1}, {"attenuationDistance", 2}, {"attenuationColor", {.5, .25, 1}}}}}}};
    file.addNode({{"mesh", 0}, {"translation", {0, 0, -2}}, {"rotation", {0, 1, 0, 0}}});
    // A white wall behind.
    json wall = file.root["meshes"][0]["primitives"][0];
    wall["material"] = 1;
    file.root["materials"].push_back({{"extensions", {{"KHR_materials_unlit", json::object()}}}});
    file.root["meshes"].push_back({{"primitives", {wall}}});
    file.addNode({{"mesh", 1}, {"translation", {0, 0, -3}}});
    addCamera(file);
    const Rgb c = render(buildFile(file, small())).image.at(4, 4);
    EXPECT_NEAR(c.x, .5f, 1e-3f);
    EXPECT_NEAR(c.y, .25f, 1e-3f);
    EXPECT_NEAR(c.z, 1, 1e-3f);
}

} // namespace
} // namespace strobe::test
