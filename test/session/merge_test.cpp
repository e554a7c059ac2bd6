#include "core/render/render_settings.h"
#include "session/files/merged_frame.h"
#include "session/files/part_header.h"
#include "session_fixture.h"

#include <fstream>
#include <random>
#include <sstream>

namespace strobe::test {
namespace {

/// A part in memory.
struct PartContent {
    PartHeader header;
    std::vector<PixelAccumulator> sums; ///< of all pixels of the header's bounds, row by row
    std::vector<FilmRecord> records, layers;
};

PartContent read(PartReader part) {
    const PixelBounds bounds = part.header().pixelBounds;
    PartContent content{part.header(), {}, {}, {}};
    content.sums.resize(size_t(bounds.width()) * size_t(bounds.height()));
    part.read({[&](int x, int y, const PixelAccumulator& sum) {
                   content.sums[size_t(y - bounds.y0) * size_t(bounds.width()) + size_t(x - bounds.x0)].add(
                       sum);
               },
               [&](FilmRecord record) { content.records.push_back(std::move(record)); },
               [&](FilmRecord record) { content.layers.push_back(std::move(record)); }});
    return content;
}

PartContent read(const std::string& bytes) {
    return read(PartReader(std::make_unique<std::istringstream>(bytes), "x"));
}

void write(const std::filesystem::path& file, const PartContent& content) {
    PartWriter writer(content.header);
    writer.addSums(content.sums);
    for (const FilmRecord& record : content.records)
        writer.addRecord(record);
    for (const FilmRecord& record : content.layers)
        writer.addLayers(record);
    writer.write(file);
}

std::string bytesOf(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

class MergeTest : public SessionTest {
  protected:
    void renderPart(const char* name, SampleSlice samples, std::optional<PixelBounds> bounds = {}) {
        RenderOptions o = writing({name});
        o.sampleRange = samples;
        o.build.pixelBounds = bounds;
        EXPECT_EQ(renderScene(o, log), Outcome::Finished);
    }
    Outcome merge(std::initializer_list<const char*> parts, const char* image, bool allowMissing = false) {
        MergeOptions o;
        o.allowMissing = allowMissing;
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
    EXPECT_EQ(merge({"b.part"}, "b.exr", true), Outcome::Finished);
    EXPECT_TRUE(hasMessage(LogLevel::Warning, "480 samples of the pixels from 0,0 to 9,15 are missing"));
}

TEST_F(MergeTest, DamagedRecordsAreErrors) {
    useAdaptiveCache();
    renderPart("a.part", {0, 8});
    const PartContent good = read(PartReader(path("a.part")));
    ASSERT_EQ(good.records.size(), 24u); // tiles of 4x4 pixels
    PartContent damaged = good;
    damaged.records[3].bytes = std::make_shared<const std::string>("x");
    write(path("b.part"), damaged);
    EXPECT_EQ(usageError([&] { merge({"b.part"}, "b.exr"); }), "the record of a tile is damaged");
    damaged = good;
    damaged.records[3].pixels = {20, 12, 25, 16};
    write(path("b.part"), damaged);
    EXPECT_EQ(usageError([&] { merge({"b.part"}, "b.exr"); }), path("b.part").string() + ": it is damaged");
}

TEST_F(MergeTest, PartsWithOtherDecisionsAreErrors) {
    useAdaptiveCache();
    renderPart("a.part", {0, 4});
    renderPart("b.part", {4, 8});
    PartContent other = read(PartReader(path("b.part")));
    other.header.key.back().second = "shares no light";
    write(path("b.part"), other);
    EXPECT_EQ(
        usageError([&] {
            merge({"a.part", "b.part"}, "m.exr");
        }),
        path("b.part").string() +
            ": it is a part of another render: integratorNote is shares no light, not shares indirect light");
}

TEST_F(MergeTest, MissingSamplesAreErrorsUnlessTheyAreAllowed) {
    renderPart("a.part", {0, 3});
    const char* missing = "1920 samples of the pixels from 0,0 to 23,15 are missing";
    EXPECT_EQ(usageError([&] { merge({"a.part"}, "merged.exr"); }),
              std::string(missing) + "; --allow-missing writes what there is");
    EXPECT_FALSE(exists("merged.exr"));
    EXPECT_EQ(merge({"a.part"}, "some.part"), Outcome::Finished) << "a part to be merged again";
    EXPECT_EQ(merge({"a.part"}, "merged.exr", true), Outcome::Finished);
    EXPECT_TRUE(hasMessage(LogLevel::Warning, missing));
    EXPECT_EQ(attribute("merged.exr", "strobe:unfinished"), "1");
    renderPart("b.part", {0, 8}, PixelBounds{0, 0, 10, 16});
    merge({"b.part"}, "cropped.exr");
    EXPECT_TRUE(hasMessage(LogLevel::Warning, "the parts show pixels 0,0 to 9,15 of a frame of 24x16"));
}

TEST_F(MergeTest, PartsThatDoNotExistAreErrorsUnlessTheyAreAllowed) {
    renderPart("a.part", {0, 5});
    renderPart("b.part", {5, 8});
    const std::string reason = ": cannot read it: No such file or directory";
    EXPECT_EQ(usageError([&] {
                  merge({"x.part", "a.part", "y.part"}, "merged.exr");
              }),
              path("x.part").string() + reason + "\n       " + path("y.part").string() + reason);
    merge({"x.part", "a.part", "y.part", "b.part"}, "merged.exr", true);
    EXPECT_TRUE(hasMessage(LogLevel::Warning, "2 of 4 parts do not exist, as " + path("x.part").string()));
    EXPECT_EQ(usageError([&] { merge({"x.part"}, "merged.exr", true); }), "none of the parts exists");
}

TEST_F(MergeTest, PartsThatDoNotFitAreErrors) {
    renderPart("a.part", {0, 5});
    renderPart("b.part", {4, 8}, PixelBounds{0, 0, 10, 16});
    EXPECT_EQ(usageError([&] {
                  merge({"a.part", "b.part"}, "merged.exr");
              }),
              path("b.part").string() + ": samples 4:8 of pixels 0 10 0 16 overlap those of " +
                  path("a.part").string());
    renderPart("b.part", {5, 8});
    options.seed = 1;
    renderPart("c.part", {5, 8});
    EXPECT_EQ(usageError([&] {
                  merge({"c.part", "a.part", "b.part", "a.part"}, "merged.exr");
              }),
              path("c.part").string() + ": it is a part of another render: seed is 1, not 0\n       " +
                  path("a.part").string() + ": samples 0:5 of pixels 0 24 0 16 overlap those of " +
                  path("a.part").string());
    EXPECT_FALSE(exists("merged.exr"));
}

TEST_F(MergeTest, OptionsAreChecked) {
    EXPECT_EQ(usageError([&] { merge({}, "merged.exr"); }), "there are no parts to merge");
    EXPECT_EQ(usageError([&] { merge({"a.part"}, "merged.gif"); }),
              "-o: \"" + path("merged.gif").string() +
                  "\" must end in .exr, .png, .jpg, .jpeg, .tif, .tiff, .hdr or .part");
}

/// A part of 2x2 pixels that lacks the sums of one.
PartContent smallPart() {
    PartContent part;
    part.header.key = {{"version", "1"}};
    part.header.files = {{"a.scene", 17}};
    part.header.fullWidth = 4;
    part.header.fullHeight = 3;
    part.header.samplesPerPixel = 2;
    part.header.pixelBounds = {1, 0, 3, 2};
    part.header.boxes = {{{1, 0, 2, 2}, {0, 1}}, {{2, 1, 3, 2}, {0, 1}}};
    part.sums.resize(4);
    part.sums[2].add(Rgb(1, 2, 3), 0.5f);
    part.records = {{{1, 0, 2, 2}, {0, 1}, std::make_shared<const std::string>("one")},
                    {{2, 0, 3, 2}, {0, 1}, std::make_shared<const std::string>("")},
                    {{2, 0, 3, 2}, {0, 1}, std::make_shared<const std::string>(10000, 'x')}};
    return part;
}

TEST(PartFileTest, WrittenPartsAreRead) {
    const PartContent part = smallPart();
    const TemporaryFolder folder;
    write(folder.path() / "p.part", part);
    const std::string bytes = bytesOf(folder.path() / "p.part");
    EXPECT_LT(bytes.size(), 1500u);
    const PartContent copy = read(bytes);
    EXPECT_EQ(copy.header.key, part.header.key);
    EXPECT_EQ(copy.header.files, part.header.files);
    ASSERT_EQ(copy.header.boxes.size(), 2u);
    EXPECT_EQ(copy.header.boxes[1].pixelBounds, part.header.boxes[1].pixelBounds);
    EXPECT_EQ(copy.sums, part.sums);
    ASSERT_EQ(copy.records.size(), 3u);
    for (size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(*copy.records[i].bytes, *part.records[i].bytes);
        EXPECT_EQ(copy.records[i].pixels, part.records[i].pixels);
    }
    EXPECT_TRUE(copy.layers.empty());
}

TEST(PartFileTest, DamagedBytesAreErrors) {
    const auto error = [](const std::string& bytes) { return usageError([&] { read(bytes); }); };
    const TemporaryFolder folder;
    write(folder.path() / "p.part", smallPart());
    const std::string good = bytesOf(folder.path() / "p.part");
    EXPECT_EQ(error(good), "");
    EXPECT_EQ(error("hello"), "x: it is not a part of a render");
    EXPECT_EQ(error("strobe part 3\n" + good), "x: it is a part of another version of strobe");
    EXPECT_EQ(error(good + "x"), "x: it is too long");
    for (size_t size = 0; size < good.size(); ++size)
        EXPECT_NE(error(good.substr(0, size)), "") << size;
    for (size_t i = 0; i < good.size(); ++i) {
        std::string flipped = good;
        flipped[i] ^= 1;
        EXPECT_NE(error(flipped), "") << i;
    }
}

/// Headers with valid checksums.
TEST(PartFileTest, InconsistentHeadersAreErrors) {
    const TemporaryFolder folder;
    const auto error = [&](const auto& change) {
        PartContent part = smallPart();
        change(part.header);
        PartWriter writer(part.header);
        writer.write(folder.path() / "p.part");
        return usageError([&] { read(bytesOf(folder.path() / "p.part")); });
    };
    const std::string damaged = "x: it is damaged";
    EXPECT_EQ(error([](PartHeader&) {}), damaged) << "it has no sums";
    EXPECT_EQ(error([](PartHeader& p) { p.fullHeight = 1; }), damaged);
    EXPECT_EQ(error([](PartHeader& p) { p.fullWidth = 1 << 20; }), damaged);
    EXPECT_EQ(error([](PartHeader& p) { p.samplesPerPixel = 0; }), damaged);
    EXPECT_EQ(error([](PartHeader& p) { p.boxes.clear(); }), damaged);
    EXPECT_EQ(error([](PartHeader& p) { p.boxes[0].samples = {1, 3}; }), damaged);
}

TEST(PartFileTest, NumbersThatDoNotFitAreInconsistent) {
    const std::string json = partHeaderToJson(smallPart().header);
    ASSERT_TRUE(partHeaderFromJson(json));
    EXPECT_EQ(partHeaderFromJson(json)->fullHeight, 3);
    for (const char* number : {"-3", "3e+10", "4294967299", "3.5", "\"3\"", "null"}) {
        std::string changed = json;
        changed.replace(json.find("4,3]"), 3, std::string("4,") + number);
        EXPECT_EQ(partHeaderFromJson(changed).value().fullHeight, -1) << number;
    }
    EXPECT_FALSE(partHeaderFromJson("{}"));
    EXPECT_FALSE(partHeaderFromJson(json.substr(1)));
}

/// Layer records without the checksum of a file: every change gives other values or an Error.
TEST_F(MergeTest, DamagedLayersAreErrors) {
    options.output.images = {path("a.part")};
    options.output.aovs = {Aov::Normal, Aov::Depth,  Aov::CryptoObject,
                           Aov::Alpha,  Aov::Direct, Aov::LightGroups};
    ASSERT_EQ(renderScene(options, log), Outcome::Finished);
    const PartContent part = read(PartReader(path("a.part")));
    ASSERT_FALSE(part.layers.empty());
    std::mt19937 random(1);
    int errors = 0;
    for (int i = 0; i < 100; ++i) {
        PartContent damaged = part;
        FilmRecord& record = damaged.layers[random() % damaged.layers.size()];
        std::string bytes = *record.bytes;
        if (i % 3 == 0)
            bytes.resize(random() % (2 * bytes.size()));
        for (int k = 0; k < 4 && !bytes.empty(); ++k)
            bytes[random() % bytes.size()] = char(random());
        record.bytes = std::make_shared<const std::string>(std::move(bytes));
        write(path("b.part"), damaged);
        PartReader reader(path("b.part"));
        MergedFrame frame(reader.header());
        try {
            frame.add(reader);
        } catch (const Error& e) {
            EXPECT_EQ(e.kind, ErrorKind::Usage);
            ++errors;
        }
    }
    EXPECT_GT(errors, 30) << "truncated records";
}

} // namespace
} // namespace strobe::test
