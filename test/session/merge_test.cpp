#include "session/aov_recorder.h"
#include "session/files/part_file.h"
#include "session_fixture.h"

#include <random>

namespace strobe::test {
namespace {

class MergeTest : public SessionTest {
  protected:
    void renderPart(const char* name, SampleSlice samples, std::optional<PixelBounds> bounds = {}) {
        RenderOptions o = writing({name});
        o.sampleRange = samples;
        o.build.pixelBounds = bounds;
        EXPECT_EQ(renderScene(o, log), Outcome::Finished);
    }
    Outcome merge(std::initializer_list<const char*> parts, const char* image) {
        MergeOptions o;
        for (const char* part : parts)
            o.parts.push_back(path(part));
        o.images = {path(image)};
        return mergeParts(o, log);
    }
    /// Renders whole.exr and the parts a, b and c of it, the latter two with other tiles, and merges them to
    /// merged.exr.
    void mergeThreeParts() {
        renderScene(writing({"whole.exr"}), log);
        renderPart("a.part", {0, 3});
        options.tileSize = 7;
        renderPart("b.part", {3, 8}, PixelBounds{0, 0, 10, 16});
        renderPart("c.part", {3, 8}, PixelBounds{10, 0, 24, 16});
        EXPECT_EQ(merge({"c.part", "b.part"}, "bc.part"), Outcome::Finished);
        EXPECT_EQ(merge({"a.part", "bc.part"}, "merged.exr"), Outcome::Finished);
        EXPECT_EQ(pixels("merged.exr"), pixels("whole.exr"));
    }
};

TEST_F(MergeTest, MergedPartsEqualTheWholeImage) {
    mergeThreeParts();
    EXPECT_EQ(attribute("merged.exr", "strobe:unfinished"), "");
}

TEST_F(MergeTest, MergingCompletesTheImage) {
    useAdaptiveCache();
    mergeThreeParts();
    EXPECT_EQ(attribute("whole.exr", "strobe:integratorNote"), "shares indirect light");
    EXPECT_EQ(attribute("merged.exr", "strobe:integratorNote"), "shares indirect light");
    EXPECT_EQ(merge({"b.part"}, "b.exr"), Outcome::Finished);
    EXPECT_TRUE(hasMessage(LogLevel::Warning, "480 samples of the pixels from 0,0 to 9,15 are missing"));
}

TEST_F(MergeTest, DamagedRecordsAreErrors) {
    useAdaptiveCache();
    renderPart("a.part", {0, 8});
    const RenderPart good = readPart(path("a.part"));
    ASSERT_EQ(good.records.size(), 24u); // tiles of 4x4 pixels
    RenderPart damaged = good;
    damaged.records[3].bytes = std::make_shared<const std::string>("x");
    writePart(path("b.part"), damaged);
    EXPECT_EQ(usageError([&] { merge({"b.part"}, "b.exr"); }), "the record of a tile is damaged");
    damaged = good;
    damaged.records[3].pixels = {20, 12, 25, 16};
    writePart(path("b.part"), damaged);
    EXPECT_EQ(usageError([&] { merge({"b.part"}, "b.exr"); }), path("b.part").string() + ": it is damaged");
}

TEST_F(MergeTest, PartsWithOtherDecisionsAreErrors) {
    useAdaptiveCache();
    renderPart("a.part", {0, 4});
    renderPart("b.part", {4, 8});
    RenderPart other = readPart(path("b.part"));
    other.key.back().second = "shares no light";
    writePart(path("b.part"), other);
    EXPECT_EQ(
        usageError([&] {
            merge({"a.part", "b.part"}, "m.exr");
        }),
        path("b.part").string() +
            ": it is a part of another render: integratorNote is shares no light, not shares indirect light");
}

TEST_F(MergeTest, MissingSamplesAreReported) {
    renderPart("a.part", {0, 3});
    EXPECT_EQ(merge({"a.part"}, "merged.exr"), Outcome::Finished);
    EXPECT_TRUE(hasMessage(LogLevel::Warning, "1920 samples of the pixels from 0,0 to 23,15 are missing"));
    renderPart("b.part", {0, 8}, PixelBounds{0, 0, 10, 16});
    merge({"b.part"}, "cropped.exr");
    EXPECT_TRUE(hasMessage(LogLevel::Warning, "the parts show pixels 0,0 to 9,15 of a frame of 24x16"));
}

TEST_F(MergeTest, PartsThatDoNotFitAreErrors) {
    renderPart("a.part", {0, 5});
    renderPart("b.part", {4, 8}, PixelBounds{0, 0, 10, 16});
    EXPECT_EQ(usageError([&] {
                  merge({"a.part", "b.part"}, "merged.exr");
              }),
              path("b.part").string() + ": samples 4:8 of pixels 0 10 0 16 overlap those of another file");
    options.seed = 1;
    renderPart("c.part", {5, 8});
    EXPECT_EQ(usageError([&] {
                  merge({"a.part", "c.part"}, "merged.exr");
              }),
              path("c.part").string() + ": it is a part of another render: seed is 1, not 0");
    EXPECT_FALSE(exists("merged.exr"));
}

TEST_F(MergeTest, OptionsAreChecked) {
    EXPECT_EQ(usageError([&] { merge({}, "merged.exr"); }), "there are no parts to merge");
    EXPECT_EQ(usageError([&] { merge({"a.part"}, "merged.gif"); }),
              "-o: \"" + path("merged.gif").string() +
                  "\" must end in .exr, .png, .jpg, .jpeg, .tif, .tiff, .hdr or .part");
}

TEST(PartFileTest, DamagedBytesAreErrors) {
    RenderPart part;
    part.key = {{"version", "1"}};
    part.fullWidth = 4;
    part.fullHeight = 3;
    part.samplesPerPixel = 2;
    part.pixelBounds = {1, 0, 3, 2};
    part.boxes = {{part.pixelBounds, {0, 1}}};
    part.sums.resize(4);
    part.sums[2].add(Rgb(1, 2, 3), 0.5f);
    part.records = {{{1, 0, 2, 2}, {0, 1}, std::make_shared<const std::string>("one")},
                    {{2, 0, 3, 2}, {0, 1}, std::make_shared<const std::string>("")},
                    {{2, 0, 3, 2}, {0, 1}, std::make_shared<const std::string>("three")}};
    const TemporaryFolder folder;
    const auto file = folder.path() / "p.part";
    writePart(file, part);
    const RenderPart read = readPart(file);
    EXPECT_EQ(read.key, part.key);
    EXPECT_EQ(read.sums, part.sums);
    ASSERT_EQ(read.records.size(), 3u);
    EXPECT_EQ(*read.records[0].bytes, "one");
    EXPECT_EQ(read.records[1].pixels.x0, 2);
    EXPECT_EQ(*read.records[2].bytes, "three");
    EXPECT_EQ(missingSamples(read), 7u);

    const auto error = [](const std::string& bytes) { return usageError([&] { parsePart(bytes, "x"); }); };
    std::ifstream stream(file, std::ios::binary);
    const std::string good{std::istreambuf_iterator<char>(stream), {}};
    EXPECT_EQ(error(good), "");
    EXPECT_EQ(error("hello"), "x: it is not a part of a render");
    EXPECT_EQ(error(good.substr(0, 40)), "x: it is damaged");
    EXPECT_EQ(error(good + "x"), "x: it is truncated or too long");
    for (const char* size : {"\"bytes\":4", "\"bytes\":18446744073709551615", "\"bytes\":-3"}) {
        std::string resized = good;
        resized.replace(good.find("\"bytes\":3"), 9, size);
        EXPECT_EQ(error(resized), "x: it is truncated or too long");
    }
    std::string flipped = good;
    flipped.back() ^= 1;
    EXPECT_EQ(error(flipped), "x: it is damaged");
}

/// Layer records without the checksum of a file: every change gives other values or an Error.
TEST_F(MergeTest, DamagedLayersAreErrors) {
    options.output.images = {path("a.part")};
    options.output.aovs = {Aov::Normal, Aov::Depth,  Aov::CryptoObject,
                           Aov::Alpha,  Aov::Direct, Aov::LightGroups};
    ASSERT_EQ(renderScene(options, log), Outcome::Finished);
    const RenderPart part = readPart(path("a.part"));
    ASSERT_FALSE(part.layers.empty());
    std::mt19937 random(1);
    int errors = 0;
    for (int i = 0; i < 500; ++i) {
        RenderPart damaged = part;
        FilmRecord& record = damaged.layers[random() % damaged.layers.size()];
        std::string bytes = *record.bytes;
        if (i % 3 == 0)
            bytes.resize(random() % (2 * bytes.size()));
        for (int k = 0; k < 4 && !bytes.empty(); ++k)
            bytes[random() % bytes.size()] = char(random());
        record.bytes = std::make_shared<const std::string>(std::move(bytes));
        Film film(damaged.fullWidth, damaged.fullHeight, damaged.pixelBounds);
        addToFilm(damaged, film);
        try {
            recordedAovs(damaged.layout, film);
        } catch (const Error& e) {
            EXPECT_EQ(e.kind, ErrorKind::Usage);
            ++errors;
        }
    }
    EXPECT_GT(errors, 150) << "truncated records";
}

} // namespace
} // namespace strobe::test
