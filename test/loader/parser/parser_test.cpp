#include "loader/parser/parser.h"

#include "support/scene_text.h"

using namespace strobe;
using namespace strobe::test;

namespace {

void expectNear(const V3f& a, const V3f& b, float tolerance = 1e-5f) {
    EXPECT_LT(length(a - b), tolerance) << a << " against " << b;
}

/// Returns point p of a sphere after the directives of `body`, in world space at `time`.
V3f placed(const std::string& body, const V3f& p, float time = 0, const std::string& name = "t.scene",
           const std::string& options = "") {
    const SceneDescription scene = parseGood(options + " WorldBegin " + body + R"( Shape "sphere")", name);
    return transformPoint(scene.world.shapes.at(0).toParent.at(time), p);
}

TEST(Parser, Transforms) {
    expectNear(placed("", {1, 2, 3}), {1, 2, 3});
    expectNear(placed("Translate 1 2 3", {1, 1, 1}), {2, 3, 4});
    expectNear(placed("Scale 2 3 -4", {1, 1, 1}), {2, 3, -4});
    expectNear(placed("Rotate 90 0 0 1", {1, 0, 0}), {0, 1, 0});
    expectNear(placed("Rotate 90 1 0 0", {0, 1, 0}), {0, 0, 1});
    expectNear(placed("Rotate 90 0 2 0", {0, 0, 1}), {1, 0, 0});
    expectNear(placed("Rotate 120 1 1 1", {1, 0, 0}), {0, 1, 0});
    expectNear(placed("Translate 1 0 0 Scale 2 2 2", {1, 0, 0}),
               {3, 0, 0}); // the last transform applies first
    expectNear(placed("Translate 9 9 9 Identity", {1, 0, 0}), {1, 0, 0});
    expectNear(placed("Scale 2 2 2 Transform [1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1]", {1, 0, 0}), {6, 6, 7});
    expectNear(placed("Scale 2 2 2 ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1]", {1, 0, 0}),
               {12, 12, 14});
}

TEST(Parser, LookAtIsLeftHanded) {
    // As in pbrt, a camera that looks along +z with y up has +x on the right of the image.
    const SceneDescription scene =
        parseGood(R"(LookAt 0 0 -3  0 0 0  0 1 0 Camera "perspective" WorldBegin)");
    const M44f m = scene.cameraToWorld.at(0);
    expectNear(transformPoint(m, {0, 0, 0}), {0, 0, -3});
    expectNear(transformVector(m, {0, 0, 1}), {0, 0, 1});
    expectNear(transformVector(m, {1, 0, 0}), {1, 0, 0});
    const SceneDescription other =
        parseGood(R"(LookAt 400 20 30  0 63 -110  0 0 1 Rotate -5 0 0 1 Camera "perspective" WorldBegin)");
    const M44f c = other.cameraToWorld.at(0);
    expectNear(transformVector(c, {0, 0, 1}).normalized(),
               transformVector(M44f().setAxisAngle({0, 0, 1}, radians(5)), normalize(V3f(-400, 43, -140))),
               1e-4f);
}

TEST(Parser, StacksSaveAndRestore) {
    const SceneDescription scene = parseGood(R"(WorldBegin
        Material "matte" Translate 1 0 0
        AttributeBegin Material "plastic" ReverseOrientation Translate 0 1 0
            AreaLightSource "area" Shape "a" AttributeEnd
        TransformBegin Translate 5 0 0 Material "mirror" TransformEnd
        Shape "b")");
    const ShapeDecl &a = scene.world.shapes.at(0), &b = scene.world.shapes.at(1);
    EXPECT_EQ(scene.materials.at(0).material.name, "matte");
    EXPECT_EQ(scene.materials.at(a.material).material.name, "plastic");
    EXPECT_EQ(a.areaLight, 0);
    EXPECT_TRUE(a.reverseOrientation);
    expectNear(transformPoint(a.toParent.at(0), V3f(0)), {1, 1, 0});
    EXPECT_EQ(scene.materials.at(b.material).material.name, "mirror");
    EXPECT_EQ(b.areaLight, -1);
    EXPECT_FALSE(b.reverseOrientation);
    expectNear(transformPoint(b.toParent.at(0), V3f(0)), {1, 0, 0});
}

TEST(Parser, DefaultMaterial) {
    const SceneDescription scene = parseGood(R"(WorldBegin Shape "sphere")");
    EXPECT_EQ(scene.world.shapes.at(0).material, 0);
    EXPECT_EQ(scene.materials.size(), 1u);
    EXPECT_TRUE(scene.world.shapes.at(0).toParent.isStatic());
}

TEST(Parser, CoordinateSystems) {
    const std::string options = R"(LookAt 1 2 3  4 5 6  0 1 0 Camera "perspective")";
    expectNear(placed(R"(CoordSysTransform "camera")", V3f(0), 0, "t.scene", options), {1, 2, 3});
    expectNear(placed(R"(Translate 1 0 0 CoordinateSystem "here" Identity CoordSysTransform "here")", V3f(0)),
               {1, 0, 0});
    expectNear(placed(R"(Translate 1 0 0 CoordSysTransform "world")", V3f(0)), {0, 0, 0});
}

TEST(Parser, MovingTransforms) {
    const std::string body = "Translate 1 0 0 ActiveTransform EndTime Translate 0 2 0";
    expectNear(placed(body, V3f(0), 0), {1, 0, 0});
    expectNear(placed(body, V3f(0), 1), {1, 2, 0});
    expectNear(placed(body, V3f(0), .5f), {1, 1, 0});
    // AttributeBegin saves the active keys; WorldBegin activates all.
    const std::string nested = "AttributeBegin ActiveTransform StartTime AttributeEnd Translate 0 0 1";
    expectNear(placed(nested, V3f(0), 1, "t.scene", "ActiveTransform StartTime"), {0, 0, 1});
    expectNear(placed(nested, V3f(0), 0, "t.scene", "ActiveTransform StartTime"), {0, 0, 1});
}

TEST(Parser, AnyNumberOfKeys) {
    const std::string options = "Translate 7 7 7 TransformTimes 0 .25 [1]", times = "TransformTimes 0 .25 1 ";
    EXPECT_NE(parseString(options + "WorldBegin").error, "");
    const std::string body = "ActiveTransform 1 Translate 0 4 0 ActiveTransform EndTime Translate 8 0 0 "
                             "ActiveTransform All Translate 0 0 1";
    expectNear(placed(body, V3f(0), 0, "t.scene", times), {0, 0, 1});
    expectNear(placed(body, V3f(0), .125f, "t.scene", times), {0, 2, 1});
    expectNear(placed(body, V3f(0), .25f, "t.scene", times), {0, 4, 1});
    expectNear(placed(body, V3f(0), 1, "t.scene", times), {8, 0, 1});
    EXPECT_EQ(parseGood("LookAt 0 0 1 0 0 0 0 1 0 TransformTimes [0 .5 1 2] WorldBegin").keyTimes,
              (std::vector<float>{0, .5f, 1, 2}));
}

TEST(Parser, ConventionOfMotion) {
    const std::string body =
        "Translate .3 0 0 ActiveTransform EndTime Translate -.3 0 0 Rotate 10 0 0 1 Scale 1 1.5 1";
    // pbrt-v2: world-to-object(t) = T(-.3(1-t),0,0) Rz(-10 t) [(1-t) I + t Rz(10) S Rz(-10)].
    const KeyedTransform v2 =
        parseGood(R"(SurfaceIntegrator "path" WorldBegin )" + body + R"( Shape "sphere")", "t.pbrt")
            .world.shapes[0]
            .toParent;
    const M44f toObject = v2.at(.5f).inverse();
    const float c = std::cos(radians(10)), s = std::sin(radians(10)), k = 2.f / 3;
    // The stretch with eigenvalue 2/3 along y, rotated by 10 degrees, halfway from the identity.
    const float xx = .5f + .5f * (c * c + k * s * s), xy = .5f * (1 - k) * s * c,
                yy = .5f + .5f * (s * s + k * c * c);
    const V3f p(.7f, -.4f, .2f), stretched(xx * p.x + xy * p.y, xy * p.x + yy * p.y, p.z);
    const float hc = std::cos(radians(5)), hs = std::sin(radians(5));
    const V3f expected(hc * stretched.x + hs * stretched.y - .15f, -hs * stretched.x + hc * stretched.y, p.z);
    expectNear(transformPoint(toObject, p), expected, 2e-5f);
    const KeyedTransform v4 = parseGood("WorldBegin " + body + R"( Shape "sphere")").world.shapes[0].toParent;
    EXPECT_GT(length(transformPoint(v4.at(.5f), p) - transformPoint(v2.at(.5f), p)), 1e-3f);
}

TEST(Parser, CameraInterpolatesCameraToWorld) {
    for (const char* name : {"t.scene", "t.pbrt"}) {
        const SceneDescription scene = parseGood(
            R"(ActiveTransform EndTime Rotate 90 0 0 1 Translate 2 0 0 ActiveTransform All Camera "perspective" WorldBegin)",
            name);
        expectNear(transformPoint(scene.cameraToWorld.at(0), V3f(0)), {0, 0, 0});
        expectNear(transformPoint(scene.cameraToWorld.at(1), V3f(0)), {-2, 0, 0});
        expectNear(transformPoint(scene.cameraToWorld.at(.5f), V3f(0)), {-1, 0, 0}); // a linear path
    }
}

Conventions conventionsOf(const std::string& text, const std::string& name) {
    return parseGood(text, name).conventions;
}

TEST(Parser, Conventions) {
    constexpr auto v2 = Conventions::PbrtV2, v4 = Conventions::PbrtV4;
    EXPECT_EQ(conventionsOf("WorldBegin", "a.scene"), v4);
    EXPECT_EQ(conventionsOf("WorldBegin", "a.pbrt"), v2);
    EXPECT_EQ(conventionsOf(R"(SurfaceIntegrator "path" WorldBegin)", "a.scene"), v4);
    EXPECT_EQ(conventionsOf(R"(Integrator "path" WorldBegin)", "a.pbrt"), v4);
    EXPECT_EQ(conventionsOf(R"(Integrator "msaa" WorldBegin)", "a.pbrt"), v2);
    EXPECT_EQ(conventionsOf(R"(WorldBegin Material "matte" "color Kd" [1 1 1])", "a.pbrt"), v2);
    EXPECT_EQ(conventionsOf(R"(WorldBegin Material "diffuse" "rgb reflectance" [1 1 1])", "a.pbrt"), v4);
    EXPECT_EQ(conventionsOf(R"(WorldBegin Shape "x" "bool y" true)", "a.pbrt"), v4);
    const std::string rgb = R"(WorldBegin Material "matte" "rgb Kd" [1 1 1] )"; // a type of all versions
    EXPECT_EQ(conventionsOf(rgb, "a.pbrt"), v4);
    for (const char* directive :
         {R"(SurfaceIntegrator "path" )", R"(VolumeIntegrator "single" )", R"(Renderer "sampler" )",
          R"(Sampler "bestcandidate" )", R"(Sampler "adaptive" )"})
        EXPECT_EQ(conventionsOf(directive + rgb, "a.pbrt"), v2);
    EXPECT_EQ(conventionsOf(rgb + R"(Volume "homogeneous")", "a.pbrt"), v2);
    EXPECT_EQ(conventionsOf(R"(Option "string conventions" "pbrt-v2" WorldBegin)", "a.scene"), v2);
    EXPECT_EQ(conventionsOf(R"(Option "string conventions" "pbrt-v4" WorldBegin)", "a.pbrt"), v4);
    EXPECT_TRUE(parseGood("WorldBegin", "a.scene").strictParameters);
    EXPECT_FALSE(parseGood("WorldBegin", "a.pbrt").strictParameters);
}

TEST(Parser, OptionDirectives) {
    const SceneDescription scene = parseGood(R"(
        Film "image" "integer xresolution" [300] Sampler "lowdiscrepancy" PixelFilter "box"
        Integrator "msaa-cache" "float block" 2  Integrator "path" "integer maxdepth" 3
        Camera "perspective" "float fov" [39] WorldBegin WorldEnd)");
    EXPECT_EQ(scene.film->name, "image");
    EXPECT_EQ(scene.film->params.get(ParamDef<int>{"xresolution", 0, ""}), 300);
    EXPECT_EQ(scene.sampler->name, "lowdiscrepancy");
    EXPECT_EQ(scene.filter->name, "box");
    EXPECT_EQ(scene.integrator->name, "msaa-cache");
    EXPECT_EQ(scene.shading->name, "path");
    EXPECT_EQ(scene.camera->name, "perspective");
    EXPECT_EQ(scene.camera->params.get(ParamDef<float>{"fov", 0, ""}), 39);
}

TEST(Parser, LastCameraIsUsed) {
    const Parsed parsed = parseString(R"(Camera "orthographic"
Translate 1 0 0 Camera "perspective" WorldBegin)");
    EXPECT_EQ(parsed.scene.camera->name, "perspective");
    expectNear(transformPoint(parsed.scene.cameraToWorld.at(0), V3f(0)), {-1, 0, 0});
    ASSERT_EQ(parsed.warnings.size(), 1u);
    EXPECT_EQ(parsed.warnings[0], R"(t.scene:1:1: note: overridden by the statement at t.scene:2:17
  Camera "orthographic"
  ^)");
}

TEST(Parser, ParameterTypes) {
    const SceneDescription scene =
        parseGood(R"(WorldBegin Shape "x" "integer a" [1 2.0] "float b" 1 "bool c" "true"
        "bool d" [false true] "string e" "s\\t" "point2 f" [1 2] "vector g" [1 2 3] "color h" [1 2 3]
        "spectrum i" [400 1 700 2] "spectrum j" "x.spd" "blackbody k" [2700 2] "normal l" [] "point  from" [0 0 1])");
    const std::vector<Param>& p = scene.world.shapes.at(0).shape.params.all();
    ASSERT_EQ(p.size(), 13u);
    EXPECT_EQ(p[0].ints, (std::vector<int>{1, 2}));
    EXPECT_EQ(p[1].floats, std::vector<float>{1});
    EXPECT_EQ(p[2].ints, std::vector<int>{1});
    EXPECT_EQ(p[3].ints, (std::vector<int>{0, 1}));
    EXPECT_EQ(p[4].strings, std::vector<std::string>{"s\\t"});
    EXPECT_EQ(p[5].type, ParamType::Point2);
    EXPECT_EQ(p[6].type, ParamType::Vector3);
    EXPECT_EQ(p[7].type, ParamType::Rgb);
    EXPECT_EQ(p[8].floats, (std::vector<float>{400, 1, 700, 2}));
    EXPECT_EQ(p[9].strings, std::vector<std::string>{"x.spd"});
    EXPECT_EQ(p[10].type, ParamType::Blackbody);
    EXPECT_TRUE(p[11].floats.empty());
    EXPECT_EQ(p[12].name, "from");
    EXPECT_EQ(p[1].where.toString(), "t.scene:1:42");
}

TEST(Parser, TextureParametersReferToTheLatestDeclaration) {
    const SceneDescription scene = parseGood(R"(WorldBegin
        Texture "t" "color" "imagemap"  Material "a" "texture Kd" "t"
        Texture "t" "float" "constant"  Material "b" "texture Kd" "t"
        Translate 1 0 0
        Texture "t" "spectrum" "checkerboard" "texture tex1" "t"  Material "c" "texture Kd" "t")");
    ASSERT_EQ(scene.textures.size(), 3u);
    EXPECT_TRUE(scene.textures[1].isFloat);
    const auto ints = [](const Statement& s) { return s.params.all().at(0).ints; };
    EXPECT_EQ(ints(scene.materials.at(1).material), (std::vector<int>{-1, 0}));
    EXPECT_EQ(ints(scene.materials.at(2).material), (std::vector<int>{1, 0}));
    EXPECT_EQ(ints(scene.textures[2].texture), (std::vector<int>{1, 0}));
    EXPECT_EQ(ints(scene.materials.at(3).material), (std::vector<int>{1, 2}));
    expectNear(transformPoint(scene.textures[2].toWorld.at(0), V3f(0)), {1, 0, 0});
}

TEST(Parser, NamedMaterials) {
    const SceneDescription scene = parseGood(R"(WorldBegin
        MakeNamedMaterial "red" "string type" "plastic" "rgb Kd" [1 0 0]
        Shape "a" NamedMaterial "red" Shape "b")");
    EXPECT_EQ(scene.world.shapes.at(0).material, 0);
    EXPECT_EQ(scene.world.shapes.at(1).material, 1);
    EXPECT_EQ(scene.materials.at(1).name, "red");
    EXPECT_EQ(scene.materials.at(1).material.name, "plastic");
    EXPECT_TRUE(scene.materials.at(1).material.params.all().at(0).used) << "the parser reads the type";
}

TEST(Parser, ObjectsAndNestedInstances) {
    const SceneDescription scene = parseGood(R"(WorldBegin
        ObjectBegin "leaf" Translate 1 0 0 Shape "disk" ObjectEnd
        ObjectBegin "tree" Translate 0 1 0 ObjectInstance "leaf" Shape "sphere" ObjectEnd
        Translate 0 0 1 ObjectInstance "tree" ObjectInstance "leaf")");
    ASSERT_EQ(scene.objects.size(), 2u);
    EXPECT_EQ(scene.objects[0].shapes.size(), 1u);
    EXPECT_EQ(scene.objects[1].instances.at(0).object, 0);
    EXPECT_EQ(scene.world.instances.size(), 2u);
    EXPECT_EQ(scene.world.instances[0].object, 1);
    EXPECT_TRUE(scene.world.shapes.empty());
    expectNear(transformPoint(scene.objects[0].shapes[0].toParent.at(0), V3f(0)), {1, 0, 0});
    expectNear(transformPoint(scene.objects[1].instances[0].toParent.at(0), V3f(0)), {0, 1, 0});
    expectNear(transformPoint(scene.world.instances[0].toParent.at(0), V3f(0)), {0, 0, 1});
}

TEST(Parser, AttributeDefaults) {
    const SceneDescription scene = parseGood(R"(WorldBegin
        AttributeBegin Attribute "shape" "bool x" true "float r" 2 Attribute "shape" "float r" 3
        Shape "a" Shape "b" "float r" 5 AttributeEnd Shape "c")");
    const auto r = [&](int i) {
        return scene.world.shapes.at(i).shape.params.get(ParamDef<float>{"r", 0, ""});
    };
    EXPECT_EQ(r(0), 3);
    EXPECT_EQ(r(1), 5);
    EXPECT_EQ(r(2), 0);
    EXPECT_TRUE(scene.world.shapes[0].shape.params.get(ParamDef<bool>{"x", false, ""}));
}

TEST(Parser, UnsupportedDirectivesAreIgnoredWithOneWarningPerKind) {
    const Parsed parsed =
        parseString(R"(Accelerator "bvh" Renderer "sampler" VolumeIntegrator "single" "float stepsize" 1
        MakeNamedMedium "fog" "string type" "homogeneous" ColorSpace "aces2065-1"
        WorldBegin MediumInterface "fog" "" MediumInterface "" "fog"
        Volume "homogeneous" "color sigma_a" [1 1 1] Volume "homogeneous" Shape "sphere")",
                    "t.pbrt");
    EXPECT_EQ(parsed.error, "");
    EXPECT_EQ(parsed.warnings.size(), 6u);
    EXPECT_EQ(parsed.scene.world.shapes.size(), 1u);
    EXPECT_EQ(parsed.warnings[2].substr(0, parsed.warnings[2].find('\n')),
              "t.pbrt:1:38: warning: VolumeIntegrator is ignored: participating media are not supported");
}

TEST(Parser, Includes) {
    const TemporaryFolder folder;
    folder.write("geo/part.pbrt", R"(Shape "sphere" Include "inner.pbrt" Include "other.pbrt")");
    folder.write("geo/inner.pbrt", R"(Shape "disk")");
    folder.write("other.pbrt", R"(Material "mirror")");
    Diagnostics quiet;
    const auto main = folder.write("main.scene", R"(WorldBegin Include "geo/part.pbrt" Shape "cone")");
    const SceneDescription scene = parseFiles({main}, {}, quiet);
    ASSERT_EQ(scene.world.shapes.size(), 3u);
    EXPECT_EQ(scene.world.shapes[1].shape.name, "disk");
    EXPECT_EQ(scene.world.shapes[2].material, 1);
    EXPECT_EQ(scene.world.shapes[1].shape.where.source->path, folder.path() / "geo/inner.pbrt");
    EXPECT_EQ(scene.world.shapes[1].shape.where.source->mainDirectory, folder.path());
}

TEST(Parser, PointersOfGitLfsAreErrorsThatSaySo) {
    const TemporaryFolder folder;
    const std::string pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
    folder.write("part.pbrt", pointer);
    Diagnostics quiet;
    const auto message = [&](const std::filesystem::path& file) {
        try {
            parseFiles({file}, {}, quiet);
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string();
    };
    const std::string expected = "is a pointer of Git LFS, not the file itself: run \"git lfs pull\"";
    EXPECT_NE(message(folder.write("main.pbrt", pointer)).find(expected), std::string::npos);
    EXPECT_NE(message(folder.write("including.scene", "WorldBegin Include \"part.pbrt\"")).find(expected),
              std::string::npos);
}

TEST(Parser, SeveralFilesAreOneScene) {
    const TemporaryFolder folder;
    const auto a = folder.write("a.scene", "Translate 1 0 0"),
               b = folder.write("b.pbrt", R"(Camera "p" WorldBegin)");
    Diagnostics quiet;
    const SceneDescription scene = parseFiles({a, b}, {}, quiet);
    EXPECT_TRUE(scene.strictParameters);
    expectNear(transformPoint(scene.cameraToWorld.at(0), V3f(0)), {-1, 0, 0});
    EXPECT_THROW(parseFiles({}, {}, quiet), Error);
}

} // namespace
