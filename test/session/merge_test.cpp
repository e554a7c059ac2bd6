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

PartReader reader(const std::string& bytes) {
    return PartReader(std::make_unique<std::istringstream>(bytes), "x");
}

/// Returns the bytes of a part's file.
std::string bytesOf(const PartContent& content) {
    PartWriter writer(content.header);
    writer.addSums(content.sums);
    for (const FilmRecord& record : content.records)
        writer.addRecord(record);
    for (const FilmRecord& record : content.layers)
        writer.addLayers(record);
    return writer.finish();
}

void write(const std::filesystem::path& file, const PartContent& content) {
    std::ofstream(file, std::ios::binary) << bytesOf(content);
}

class MergeTest : public SessionTest {
  protected:
    void renderPart(const char* name, SampleSlice samples, std::optional<PixelBounds> bounds = {}) {
        RenderOptions o = writing({name});
        o.sampleRange = samples;
        o.build.pixelBounds = bounds;
        EXPECT_EQ(renderScene(o, log), Outcome::Finished);
    }
    void renderSlice(const char* name, FrameSlice slice) {
        RenderOptions o = writing({name});
        o.slice = slice;
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
    damaged.records[3].bytes = std::string("x");
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

TEST_F(MergeTest, SlicesMergeToTheWholeImage) {
    for (const bool isAdaptive : {false, true}) {
        if (isAdaptive)
            useAdaptiveCache();
        renderScene(writing({"whole.exr"}), log);
        for (const uint32_t number : {0u, 1u, 2u}) {
            renderSlice(("s" + std::to_string(number) + ".part").c_str(), {number, 3});
            options.tileSize += 3;
        }
        EXPECT_EQ(merge({"s2.part", "s1.part"}, "some.part"), Outcome::Finished);
        EXPECT_EQ(merge({"some.part", "s0.part"}, "merged.exr"), Outcome::Finished);
        EXPECT_EQ(pixels("merged.exr"), pixels("whole.exr"));
        EXPECT_EQ(attribute("merged.exr", "strobe:unfinished"), "");
    }
}

TEST_F(MergeTest, MissingAndDoubledSlicesAreErrors) {
    for (const uint32_t number : {1u, 2u, 3u, 6u})
        renderSlice((std::to_string(number) + ".part").c_str(), {number, 9});
    EXPECT_EQ(usageError([&] {
                  merge({"1.part", "2.part", "3.part", "6.part"}, "merged.exr");
              }),
              "slices 1, 5-6, 8-9 of 9 are missing; --allow-missing writes what there is");
    EXPECT_EQ(merge({"1.part", "2.part", "3.part", "6.part"}, "merged.exr", true), Outcome::Finished);
    EXPECT_TRUE(hasMessage(LogLevel::Warning, "slices 1, 5-6, 8-9 of 9 are missing"));
    EXPECT_EQ(attribute("merged.exr", "strobe:unfinished"), "1");
    renderSlice("again.part", {2, 9});
    EXPECT_EQ(usageError([&] {
                  merge({"1.part", "2.part", "again.part"}, "merged.exr");
              }),
              path("again.part").string() + ": slice 3 of 9 is also in " + path("2.part").string());
    renderSlice("other.part", {0, 2});
    EXPECT_NE(usageError([&] {
                  merge({"1.part", "other.part"}, "merged.exr");
              }).find("overlap those of " + path("1.part").string()),
              std::string::npos);
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
    part.records = {{{1, 0, 2, 2}, {0, 1}, std::string("one")},
                    {{2, 0, 3, 2}, {0, 1}, std::string("")},
                    {{2, 0, 3, 2}, {0, 1}, std::string(10000, 'x')}};
    return part;
}

TEST(PartFileTest, WrittenPartsAreRead) {
    const PartContent part = smallPart();
    const std::string bytes = bytesOf(part);
    EXPECT_LT(bytes.size(), 1500u);
    const PartContent copy = read(reader(bytes));
    EXPECT_EQ(copy.header.key, part.header.key);
    EXPECT_EQ(copy.header.files, part.header.files);
    ASSERT_EQ(copy.header.boxes.size(), 2u);
    EXPECT_EQ(copy.header.boxes[1].pixelBounds, part.header.boxes[1].pixelBounds);
    EXPECT_EQ(copy.sums, part.sums);
    ASSERT_EQ(copy.records.size(), 3u);
    for (size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(copy.records[i].bytes.view(), part.records[i].bytes.view());
        EXPECT_EQ(copy.records[i].pixels, part.records[i].pixels);
    }
    EXPECT_TRUE(copy.layers.empty());
}

TEST(PartFileTest, DamagedBytesAreErrors) {
    const auto error = [](const std::string& bytes) { return usageError([&] { read(reader(bytes)); }); };
    const std::string good = bytesOf(smallPart());
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
    const auto error = [](const auto& change) {
        PartContent part = smallPart();
        change(part.header);
        return usageError([&] { read(reader(PartWriter(part.header).finish())); });
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
    for (int i = 0; i < 500; ++i) {
        PartContent damaged = part;
        FilmRecord& record = damaged.layers[random() % damaged.layers.size()];
        std::string bytes(record.bytes.view());
        if (i % 3 == 0)
            bytes.resize(random() % (2 * bytes.size()));
        for (int k = 0; k < 4 && !bytes.empty(); ++k)
            bytes[random() % bytes.size()] = char(random());
        record.bytes = std::string(std::move(bytes));
        PartReader read = reader(bytesOf(damaged));
        MergedFrame frame(read.header());
        try {
            frame.add(read);
        } catch (const Error& e) {
            EXPECT_EQ(e.kind, ErrorKind::Usage);
            ++errors;
        }
    }
    EXPECT_GT(errors, 150) << "truncated records";
}

} // namespace
} // namespace strobe::test
