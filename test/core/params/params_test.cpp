#include "core/params/params.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

using namespace strobe;

namespace {

const ParamDef<int> kCount{"count", 4, "a number of items"};
const ParamDef<float> kFov{"fov", 90, "degrees"};
const ParamDef<bool> kFlag{"flag", true, "a switch"};
const ParamDef<std::string> kMode{"mode", "fast", "a mode"};
const ParamDef<V2f> kUv{"uv", V2f(0, 1), "corner"};
const ParamDef<V3f> kFrom{"from", V3f(0, 0, 1), "where"};
const ParamDef<Rgb> kL{"L", Rgb(1, .5f, 0), "radiance"};
const ParamDef<FilePath> kFile{"filename", {}, "a file"};
const ParamDef<FloatInput> kRoughness{"roughness", .1f, "width", "alpha"};
const ParamDef<RgbInput> kKd{"Kd", Rgb(.5f), "diffuse", "reflectance"};
const ParamDef<std::vector<V3f>> kP{"P", {}, "points"};
const ParamDef<std::vector<int>> kIndices{"indices", {1, 2}, "corners"};

Location location(size_t offset = 0) {
    static const auto source = std::make_shared<Source>("d/a.scene", "0123456789", nullptr, "d");
    return {source, offset};
}

Param make(const std::string& name, ParamType type, std::vector<float> floats, std::vector<int> ints = {},
           std::vector<std::string> strings = {}) {
    return {name, type, location(3), std::move(floats), std::move(ints), std::move(strings), false, false};
}

ParamSet setOf(std::vector<Param> params) {
    ParamSet set(location(1));
    for (Param& p : params)
        set.add(std::move(p));
    return set;
}

template <class F>
std::string errorOf(F f) {
    try {
        f();
    } catch (const Error& e) {
        return e.location.toString() + " " + e.what();
    }
    return "no error";
}

struct Constant : Texture {
    explicit Constant(float v) : v(v) {}
    Rgb rgb(const TextureQuery&) const override { return Rgb(v); }
    float v;
};

TEST(Params, AbsentParametersHaveTheirDefault) {
    const ParamSet none(location());
    EXPECT_EQ(none.get(kCount), 4);
    EXPECT_EQ(none.get(kL), Rgb(1, .5f, 0));
    EXPECT_EQ(none.get(kIndices), (std::vector<int>{1, 2}));
    EXPECT_EQ(none.get(kFile).path, "");
    EXPECT_FALSE(none.has(kFov));
    EXPECT_EQ(none.typeOf(kFov), std::nullopt);
    EXPECT_EQ(errorOf([&] { none.require(kFov); }), "d/a.scene:1:1 parameter \"fov\" is missing");
}

TEST(Params, AllTypesAreRead) {
    const ParamSet set =
        setOf({make("count", ParamType::Int, {}, {7}), make("fov", ParamType::Int, {}, {39}),
               make("flag", ParamType::Bool, {}, {0}), make("mode", ParamType::String, {}, {}, {"slow"}),
               make("uv", ParamType::Float, {2, 3}), make("from", ParamType::Vector3, {1, 2, 3}),
               make("L", ParamType::Rgb, {4, 5, 6}), make("roughness", ParamType::Float, {.2f}),
               make("Kd", ParamType::Rgb, {.1f, .2f, .3f}), make("P", ParamType::Vector3, {1, 2, 3, 4, 5, 6}),
               make("indices", ParamType::Int, {}, {0, 1, 2})});
    EXPECT_EQ(set.get(kCount), 7);
    EXPECT_EQ(set.get(kFov), 39);
    EXPECT_EQ(set.typeOf(kFov), ParamType::Int);
    EXPECT_FALSE(set.get(kFlag));
    EXPECT_EQ(set.get(kMode), "slow");
    EXPECT_EQ(set.get(kUv), V2f(2, 3));
    EXPECT_EQ(set.get(kFrom), V3f(1, 2, 3));
    EXPECT_EQ(set.get(kL), Rgb(4, 5, 6));
    EXPECT_EQ(set.get(kRoughness).constant, .2f);
    EXPECT_EQ(set.get(kKd).constant, Rgb(.1f, .2f, .3f));
    EXPECT_EQ(set.get(kP), (std::vector<V3f>{{1, 2, 3}, {4, 5, 6}}));
    EXPECT_EQ(set.get(kIndices), (std::vector<int>{0, 1, 2}));
    Diagnostics quiet;
    EXPECT_NO_THROW(set.reportUnused({}, true, quiet));
}

TEST(Params, SpectraAreConvertedToColors) {
    const ParamSet flat = setOf({make("L", ParamType::Spectrum, {400, 1, 700, 1})});
    EXPECT_NEAR(flat.get(kL).x, 1.205f, 2e-3f);
    EXPECT_NEAR(flat.get(kL).z, .909f, 2e-3f);
    const Rgb warm = setOf({make("L", ParamType::Blackbody, {2700})}).get(kL);
    EXPECT_GT(warm.x, warm.z);
    EXPECT_NO_THROW(setOf({make("L", ParamType::Spectrum, {}, {}, {"metal-Cu-eta"})}).get(kL));
    EXPECT_EQ(errorOf([] {
                  setOf({make("L", ParamType::Spectrum, {700, 1, 400, 1})}).get(kL);
              }),
              "d/a.scene:1:4 the wavelengths of \"L\" must ascend");
    EXPECT_EQ(errorOf([] { setOf({make("L", ParamType::Spectrum, {}, {}, {"x.spd"})}).get(kL); }),
              "d/a.scene:1:4 file \"x.spd\" not found; looked for \"d/x.spd\"");
}

TEST(Params, TexturesOfTheOtherTypeAreAccepted) {
    const auto table = std::make_shared<TextureTable>();
    table->floats = {std::make_shared<Constant>(.25f)};
    table->rgbs = {std::make_shared<Constant>(.5f), std::make_shared<Constant>(.75f)};
    ParamSet set = setOf({make("Kd", ParamType::Texture, {}, {0, 1}, {"both"}),
                          make("roughness", ParamType::Texture, {}, {-1, 0}, {"rgb only"})});
    EXPECT_EQ(errorOf([&] { set.get(kKd); }), "d/a.scene:1:4 parameter \"Kd\" cannot be a texture here");
    set.bindTextures(table);
    EXPECT_EQ(set.get(kKd).at({}), Rgb(.75f));
    EXPECT_EQ(set.get(kRoughness).at({}), .5f);
}

TEST(Params, RangesHoldForConstantsNotForTextures) {
    const ParamDef<FloatInput> exponent{"exponent", 2, "", nullptr, kAtLeastOne};
    const auto table = std::make_shared<TextureTable>();
    table->floats = {std::make_shared<Constant>(.5f)};
    ParamSet set = setOf({make("exponent", ParamType::Texture, {}, {0, -1}, {"texture"})});
    set.bindTextures(table);
    EXPECT_EQ(set.get(exponent).at({}), .5f);
    EXPECT_EQ(errorOf([&] { setOf({make("exponent", ParamType::Float, {.5f})}).get(exponent); }),
              "d/a.scene:1:4 \"exponent\" must be at least 1");
}

TEST(Params, WrongTypesAndNumbersOfValuesAreErrors) {
    EXPECT_EQ(errorOf([] { setOf({make("fov", ParamType::String, {}, {}, {"x"})}).get(kFov); }),
              "d/a.scene:1:4 parameter \"fov\" must be float or integer, not string");
    EXPECT_EQ(errorOf([] {
                  setOf({make("fov", ParamType::Float, {1, 2})}).get(kFov);
              }),
              "d/a.scene:1:4 parameter \"fov\" needs 1 value, got 2");
    EXPECT_EQ(errorOf([] { setOf({make("count", ParamType::Float, {1})}).get(kCount); }),
              "d/a.scene:1:4 parameter \"count\" must be integer, not float");
    EXPECT_EQ(errorOf([] { setOf({make("L", ParamType::Rgb, {})}).get(kL); }),
              "d/a.scene:1:4 parameter \"L\" needs 3 values, got 0");
    EXPECT_EQ(errorOf([] {
                  setOf({make("P", ParamType::Vector3, {1, 2})}).get(kP);
              }),
              "d/a.scene:1:4 parameter \"P\" needs a multiple of 3 numbers, got 2");
}

TEST(Params, WordsHaveValues) {
    const auto speedOf = [](const ParamSet& set) {
        return parseWord<int>(set, kMode, {{"slow", 1}, {"fast", 2}, {"quick", 2}});
    };
    const auto modeOf = [](const char* word) {
        return setOf({make("mode", ParamType::String, {}, {}, {word})});
    };
    EXPECT_EQ(speedOf(setOf({})), 2);
    EXPECT_EQ(speedOf(modeOf("slow")), 1);
    EXPECT_EQ(speedOf(modeOf("quick")), 2);
    EXPECT_EQ(errorOf([&] { speedOf(modeOf("solw")); }),
              "d/a.scene:1:4 unknown mode \"solw\"; did you mean \"slow\"? (known: slow, fast, quick)");
    EXPECT_EQ(errorOf([&] { speedOf(modeOf("")); }),
              "d/a.scene:1:4 unknown mode \"\" (known: slow, fast, quick)");
}

TEST(Params, AliasesAreAcceptedAndDuplicatesAreErrors) {
    ParamSet set = setOf({make("alpha", ParamType::Float, {.3f})});
    EXPECT_EQ(set.get(kRoughness).constant, .3f);
    EXPECT_EQ(errorOf([&] { set.add(make("alpha", ParamType::Float, {1})); }),
              "d/a.scene:1:4 parameter \"alpha\" is given twice");
    set.add(make("roughness", ParamType::Float, {.4f}));
    EXPECT_EQ(errorOf([&] { set.get(kRoughness); }),
              "d/a.scene:1:4 \"alpha\" and \"roughness\" are names of the same parameter; give one of them");
    set.replace(make("roughness", ParamType::Float, {.5f}), {kRoughness, kKd});
    EXPECT_EQ(set.all().size(), 1u);
    EXPECT_EQ(set.get(kRoughness).constant, .5f);
}

TEST(Params, DirectivesOverrideAttributeDefaults) {
    Param fallback = make("alpha", ParamType::Float, {.3f});
    fallback.isDefault = true;
    EXPECT_EQ(setOf({fallback, make("roughness", ParamType::Float, {.4f})}).get(kRoughness).constant, .4f);
    EXPECT_EQ(setOf({make("roughness", ParamType::Float, {.4f}), fallback}).get(kRoughness).constant, .4f);
    Diagnostics quiet;
    setOf({fallback}).reportUnused({kRoughness}, true, quiet);
    EXPECT_EQ(quiet.count(), 0);
    setOf({fallback}).reportUnused({kKd}, true, quiet);
    EXPECT_EQ(quiet.count(), 1);
}

TEST(Params, UnusedParametersAreReported) {
    const ParamSet set = setOf({make("Kdd", ParamType::Rgb, {1, 1, 1})});
    EXPECT_EQ(set.get(kKd).constant, Rgb(.5f));
    std::vector<std::string> seen;
    Diagnostics diagnostics([&](const std::string& m) { seen.push_back(m); });
    const std::vector<ParamInfo> known{kKd, kRoughness};
    EXPECT_EQ(errorOf([&] { set.reportUnused(known, true, diagnostics); }),
              "d/a.scene:1:4 unknown parameter \"Kdd\"; did you mean \"Kd\"? "
              "(known: Kd, reflectance, roughness, alpha)");
    set.reportUnused(known, false, diagnostics);
    ASSERT_EQ(seen.size(), 1u);
    EXPECT_EQ(seen[0], "d/a.scene:1:4: warning: parameter \"Kdd\" is ignored; did you mean \"Kd\"? "
                       "(known: Kd, reflectance, roughness, alpha)\n  0123456789\n     ^");
    EXPECT_EQ(errorOf([&] {
                  setOf({make("alpha", ParamType::Float, {1})}).reportUnused(known, true, diagnostics);
              }),
              "d/a.scene:1:4 parameter \"alpha\" has no effect here");
    set.markAllUsed();
    EXPECT_NO_THROW(set.reportUnused(known, true, diagnostics));
}

TEST(ParamInfo, HasTypesAndDefaultsAsText) {
    const auto row = [](const ParamInfo& i) {
        return i.name + "|" + i.type + "|" + i.fallback + "|" + i.alias;
    };
    EXPECT_EQ(row(kCount), "count|integer|4|");
    EXPECT_EQ(row(kFov), "fov|float|90|");
    EXPECT_EQ(row(kFlag), "flag|bool|true|");
    EXPECT_EQ(row(kMode), "mode|string|\"fast\"|");
    EXPECT_EQ(row(kL), "L|rgb|1 0.5 0|");
    EXPECT_EQ(row(kRoughness), "roughness|float or texture|0.1|alpha");
    EXPECT_EQ(row(kKd), "Kd|rgb or texture|0.5 0.5 0.5|reflectance");
    EXPECT_EQ(row(kIndices), "indices|integer[]|1 2|");
    EXPECT_EQ(row(kP), "P|vector3[]||");
    EXPECT_EQ(row(kFile), "filename|file||");
}

TEST(ParseOverride, AllTypesAreParsed) {
    const std::vector<ParamInfo> known{kCount, kFov, kFlag, kMode, kUv, kFrom, kL, kRoughness, kKd, kIndices};
    EXPECT_EQ(parseOverride("count=+3", known).ints, std::vector<int>{3});
    EXPECT_EQ(parseOverride("fov=1e1", known).floats, std::vector<float>{10});
    EXPECT_EQ(parseOverride("flag=false", known).ints, std::vector<int>{0});
    EXPECT_EQ(parseOverride("mode=a=b", known).strings, std::vector<std::string>{"a=b"});
    EXPECT_EQ(parseOverride("uv=1,2", known).type, ParamType::Point2);
    EXPECT_EQ(parseOverride("L=1 2 3", known).floats, (std::vector<float>{1, 2, 3}));
    EXPECT_EQ(parseOverride("reflectance=1, 2, 3", known).name, "Kd");
    EXPECT_EQ(parseOverride("Kd=1 2 3", known).type, ParamType::Rgb);
    EXPECT_EQ(parseOverride("alpha=.5", known).type, ParamType::Float);
    EXPECT_EQ(parseOverride("indices=0 1 2", known).ints, (std::vector<int>{0, 1, 2}));
}

TEST(ParseOverride, MalformedOptionsAreErrors) {
    const std::vector<ParamInfo> known{kCount, kFov, kFlag, kL};
    const auto errorFor = [&](const std::string& word) {
        return errorOf([&] { parseOverride(word, known); });
    };
    EXPECT_EQ(errorFor("fovv=3"), " -D fovv=3: unknown parameter \"fovv\"; did you mean \"fov\"? "
                                  "(known: count, fov, flag, L)");
    EXPECT_EQ(errorFor("fov"), " -D fov: write it as name=value");
    EXPECT_EQ(errorFor("fov=wide"), " -D fov=wide: \"wide\" is not a number (float is expected)");
    EXPECT_EQ(errorFor("fov=nan"), " -D fov=nan: \"nan\" is not a number (float is expected)");
    EXPECT_EQ(errorFor("fov="), " -D fov=: 1 number is needed, got 0");
    EXPECT_EQ(errorFor("count=2.5"), " -D count=2.5: \"2.5\" is not an integer (integer is expected)");
    EXPECT_EQ(errorFor("count=3.0"), " -D count=3.0: \"3.0\" is not an integer (integer is expected)");
    EXPECT_EQ(errorFor("count=-3e9"),
              " -D count=-3e9: \"-3e9\" does not fit a 32-bit integer (integer is expected)");
    EXPECT_EQ(errorFor("fov=1e400"),
              " -D fov=1e400: \"1e400\" does not fit a 32-bit float (float is expected)");
    EXPECT_EQ(errorFor("flag=1"), " -D flag=1: true or false is expected");
    EXPECT_EQ(errorFor("L=1 2"), " -D L=1 2: 3 numbers are needed, got 2");
    try {
        parseOverride("x=1", known);
    } catch (const Error& e) {
        EXPECT_EQ(e.kind, ErrorKind::Usage);
    }
}

class ResolveFile : public ::testing::Test {
  protected:
    void SetUp() override {
        root = std::filesystem::temp_directory_path() / ("strobe-ResolveFile-" + std::to_string(::getpid()));
        std::filesystem::remove_all(root);
        for (const char* name : {"a/geo/mesh.ply", "a/tex.png", "a/geo/tex.png", "shared/scenes/s/x.pbrt"}) {
            std::filesystem::create_directories((root / name).parent_path());
            std::ofstream(root / name) << name;
        }
        where = {std::make_shared<Source>(root / "a/geo/part.pbrt", "", nullptr, root / "a"), 0};
    }
    void TearDown() override { std::filesystem::remove_all(root); }
    std::filesystem::path root;
    Location where;
};

TEST_F(ResolveFile, SearchesTheDirectoryOfTheSourceThenTheMainDirectory) {
    EXPECT_EQ(resolveFile("mesh.ply", where), root / "a/geo/mesh.ply");
    EXPECT_EQ(resolveFile("tex.png", where), root / "a/geo/tex.png");
    EXPECT_EQ(resolveFile("geo/mesh.ply", where), root / "a/geo/mesh.ply");
    EXPECT_EQ(resolveFile((root / "a/tex.png").string(), where), root / "a/tex.png");
    EXPECT_EQ(errorOf([&] { resolveFile("no.png", where); }),
              where.toString() + " file \"no.png\" not found; looked for \"" +
                  (root / "a/geo/no.png").string() + "\" and \"" + (root / "a/no.png").string() + "\"");
    EXPECT_THROW(resolveFile("geo", {}), Error); // a directory
    EXPECT_THROW(resolveFile("", where), Error);
}

TEST_F(ResolveFile, SearchesSharedScenes) {
    ::unsetenv("STROBE_SCENES");
    EXPECT_EQ(resolveFile("$STROBE_SCENES/s/x.pbrt", where), root / "shared/scenes/s/x.pbrt");
    EXPECT_THROW(resolveFile("$STROBE_SCENES/s/y.pbrt", where), Error);
    ::setenv("STROBE_SCENES", (root / "a").c_str(), 1);
    EXPECT_EQ(resolveFile("$STROBE_SCENES/tex.png", where), root / "a/tex.png");
    EXPECT_THROW(resolveFile("$STROBE_SCENES/s/x.pbrt", where), Error);
    ::unsetenv("STROBE_SCENES");
}

/// Of a spectrum, the values are compared, not the wavelengths; of a blackbody, nothing is.
TEST(Params, PhysicalRangesApplyToTheValuesOfSpectra) {
    const ParamDef<RgbInput> def{"Kd", Rgb(.5f), "diffuse", nullptr, kUnlimited, kUnitRange};
    const auto problem = [&](ParamType type, std::vector<float> floats) {
        Diagnostics diagnostics;
        return errorOf(
            [&] { setOf({make("Kd", type, std::move(floats))}).checkPhysical({def}, true, diagnostics); });
    };
    EXPECT_EQ(problem(ParamType::Spectrum, {400, 0, 700, 1}), "no error");
    EXPECT_EQ(problem(ParamType::Blackbody, {3000, 1}), "no error");
    EXPECT_EQ(problem(ParamType::Spectrum, {400, 0, 700, 2}), "d/a.scene:1:4 \"Kd\" must be at most 1");
    EXPECT_EQ(problem(ParamType::Rgb, {0, 2, 0}), "d/a.scene:1:4 \"Kd\" must be at most 1");
}

} // namespace
