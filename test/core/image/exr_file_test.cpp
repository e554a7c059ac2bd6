#include "support/image_files.h"

#include <OpenImageIO/imageio.h>

#include <fstream>

namespace strobe {
namespace {

class ExrFiles : public ImageFiles {
  protected:
    /// Makes colors, a layer of floats and a layer of integers. The last color has a value beyond the range
    /// of half floats.
    void SetUp() override {
        ImageFiles::SetUp();
        for (int i = 0; i < kWidth * kHeight; ++i) {
            m_colors.push_back(Rgb(float(i % kWidth) / 8, std::sin(float(i)) + 2, 5.5f));
            m_numbers.push_back(float(i) + 1 / 3.f);
            m_integers.push_back(4000000000u + uint32_t(i));
        }
        m_colors.back().z = 1e6f;
    }
    std::vector<ExrPart> parts() const {
        const float* data = &m_colors[0].x;
        return {{"rgba", {{"R", data, 3}, {"G", data + 1, 3}, {"B", data + 2, 3}}},
                {"number", {{"number.Y", m_numbers.data(), 1, true}}, {{"about", std::string("numbers")}}},
                {"id", {{"id.I", m_integers.data()}}}};
    }
    size_t write(const std::string& words) const {
        return writeExr(*this / "a.exr", {{3, 2, 3 + kWidth, 2 + kHeight}, {100, 60}}, parts(),
                        {{"renderer", std::string("strobe")}, {"samples", 64}, {"seconds", 1.5f}},
                        parseExrSettings(words));
    }
    /// Returns the values of a channel, in any part, as read by OpenImageIO.
    std::vector<double> channel(const std::string& name, OIIO::TypeDesc* type = nullptr) const {
        const auto file = OIIO::ImageInput::open((*this / "a.exr").string());
        for (int i = 0; file && file->seek_subimage(i, 0); ++i) {
            const OIIO::ImageSpec spec = file->spec();
            const int c = spec.channelindex(name);
            if (c < 0)
                continue;
            if (type)
                *type = spec.channelformat(c);
            if (spec.channelformat(c) == OIIO::TypeDesc::UINT)
                return read<uint32_t>(*file, i, c, OIIO::TypeDesc::UINT);
            return read<float>(*file, i, c, OIIO::TypeDesc::FLOAT);
        }
        return {};
    }
    static constexpr int kWidth = 37, kHeight = 21;
    std::vector<Rgb> m_colors;
    std::vector<float> m_numbers;
    std::vector<uint32_t> m_integers;

  private:
    template <class T>
    static std::vector<double> read(OIIO::ImageInput& file, int part, int c, OIIO::TypeDesc type) {
        std::vector<T> values(kWidth * kHeight);
        EXPECT_TRUE(file.read_image(part, 0, c, c + 1, type, values.data())) << file.geterror();
        return {values.begin(), values.end()};
    }
};

TEST_F(ExrFiles, AllSettingsCanBeReadBack) {
    for (const char* compression :
         {"none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab:5"})
        for (const char* order : {"scanlines", "tiles:16", "tiles"})
            for (const char* type : {"float", "half"}) {
                const std::string words = std::string(compression) + "," + order + "," + type + ",parts";
                SCOPED_TRACE(words);
                const bool half = type[0] == 'h', lossy = std::string("pbd").find(compression[0]) < 3 &&
                                                          std::string(compression) != "piz";
                EXPECT_EQ(write(words), half ? 1u : 0u);
                const auto green = channel("G"), numbers = channel("number.Y"), integers = channel("id.I");
                ASSERT_EQ(green.size(), m_colors.size());
                for (size_t i = 0; i < green.size(); ++i)
                    ASSERT_NEAR(green[i], m_colors[i].y, lossy ? .1 : half ? 1e-3 : 0) << i;
                EXPECT_TRUE(std::equal(numbers.begin(), numbers.end(), m_numbers.begin(), m_numbers.end()));
                EXPECT_TRUE(
                    std::equal(integers.begin(), integers.end(), m_integers.begin(), m_integers.end()));
            }
    EXPECT_EQ(fileCount(), 1u);
}

TEST_F(ExrFiles, HeadersDescribeTheFile) {
    write("half,tiles:16,piz,parts");
    const auto file = OIIO::ImageInput::open((*this / "a.exr").string());
    ASSERT_TRUE(file);
    const std::vector<std::string> names{"rgba", "number", "id"};
    for (int i = 0; i < 3; ++i) {
        ASSERT_TRUE(file->seek_subimage(i, 0));
        const OIIO::ImageSpec& spec = file->spec();
        EXPECT_EQ(spec.get_string_attribute("name"), names[size_t(i)]);
        EXPECT_EQ(spec.get_string_attribute("compression"), "piz");
        EXPECT_EQ(spec.tile_width, 16);
        EXPECT_EQ(spec.get_string_attribute("oiio:ColorSpace"), i == 0 ? "lin_rec709" : "data");
        EXPECT_EQ(spec.get_string_attribute("colorInteropID"), i == 0 ? "lin_rec709_scene" : "data");
        EXPECT_EQ(
            std::vector<int>({spec.full_width, spec.full_height, spec.x, spec.y, spec.width, spec.height}),
            std::vector<int>({100, 60, 3, 2, kWidth, kHeight}));
        const auto* primaries = spec.find_attribute("chromaticities");
        ASSERT_TRUE(primaries);
        EXPECT_FLOAT_EQ(static_cast<const float*>(primaries->data())[0], .64f);
    }
    ASSERT_FALSE(file->seek_subimage(3, 0));
    ASSERT_TRUE(file->seek_subimage(1, 0));
    EXPECT_EQ(file->spec().get_string_attribute("about"), "numbers");
    ASSERT_TRUE(file->seek_subimage(0, 0));
    EXPECT_EQ(file->spec().get_string_attribute("renderer"), "strobe");
    EXPECT_EQ(file->spec().get_int_attribute("samples"), 64);
    EXPECT_EQ(file->spec().get_float_attribute("seconds"), 1.5f);
    OIIO::TypeDesc type;
    channel("R", &type);
    EXPECT_EQ(type, OIIO::TypeDesc::HALF);
    channel("number.Y", &type);
    EXPECT_EQ(type, OIIO::TypeDesc::FLOAT);
}

TEST_F(ExrFiles, SinglePartHasAllChannelsAndMetadata) {
    write("half");
    const auto file = OIIO::ImageInput::open((*this / "a.exr").string());
    ASSERT_TRUE(file);
    EXPECT_EQ(file->spec().channelnames, std::vector<std::string>({"R", "G", "B", "id.I", "number.Y"}));
    EXPECT_EQ(file->spec().get_string_attribute("about"), "numbers");
    EXPECT_EQ(file->spec().get_string_attribute("compression"), "zip");
    EXPECT_FALSE(file->seek_subimage(1, 0));
    EXPECT_EQ(channel("number.Y")[7], m_numbers[7]);
}

TEST_F(ExrFiles, FiniteValuesAreClampedToTheRangeOfHalfFloats) {
    m_colors[0] = Rgb(-1e9f, INFINITY, NAN);
    EXPECT_EQ(write("half"), 2u);
    EXPECT_EQ(channel("R")[0], -65504);
    EXPECT_EQ(channel("B").back(), 65504);
    EXPECT_EQ(channel("G")[0], INFINITY);
    EXPECT_TRUE(std::isnan(channel("B")[0]));
}

TEST_F(ExrFiles, DwaLevelsChangeTheFileSize) {
    const auto size = [&](const std::string& words) {
        writeExr(*this / "a.exr", {{0, 0, kWidth, kHeight}, {kWidth, kHeight}}, {parts()[0]}, {},
                 parseExrSettings(words));
        return fs::file_size(*this / "a.exr");
    };
    EXPECT_GT(size("half,dwaa:0"), size("half,dwaa:1000"));
    EXPECT_EQ(size("half,dwaa"), size("half,dwaa:45"));
}

TEST_F(ExrFiles, LossyCompressionOfDataIsAnError) {
    for (const char* words : {"dwaa", "dwab", "pxr24"}) {
        try {
            write(words);
            ADD_FAILURE() << "no error";
        } catch (const Error& e) {
            EXPECT_EQ(e.kind, ErrorKind::Usage);
            EXPECT_EQ(e.what(),
                      "cannot write " + (*this / "a.exr").string() + ": " + words +
                          " would change the data in \"number\"; use zip, or add \"parts\" to compress that "
                          "layer without loss");
        }
    }
    EXPECT_EQ(fileCount(), 0u);
    write("b44");
    EXPECT_EQ(channel("number.Y")[7], m_numbers[7]);
}

TEST_F(ExrFiles, DoNotDependOnTheNumberOfThreads) {
    constexpr int kLarge = 200;
    std::vector<float> values(size_t(kLarge) * kLarge);
    for (size_t i = 0; i < values.size(); ++i)
        values[i] = std::sin(float(i));
    const std::vector<ExrPart> parts{{"a", {{"R", values.data()}}}, {"b", {{"b.Y", values.data(), 1, true}}}};
    for (const char* words : {"zip", "piz", "zips,parts", "zip,tiles:32", "dwaa,half,parts"}) {
        std::string bytes[3];
        for (const int threads : {0, 1, 5}) {
            const fs::path file = *this / "t.exr";
            writeExr(file, {{0, 0, kLarge, kLarge}, {kLarge, kLarge}}, parts, {}, parseExrSettings(words),
                     threads);
            std::ifstream stream(file, std::ios::binary);
            bytes[threads % 3] = std::string(std::istreambuf_iterator<char>(stream), {});
        }
        EXPECT_FALSE(bytes[0].empty());
        EXPECT_EQ(bytes[0], bytes[1]) << words;
        EXPECT_EQ(bytes[0], bytes[2]) << words;
    }
}

TEST_F(ExrFiles, InvalidArgumentsAreErrors) {
    const float zero[4] = {};
    const auto write = [&](const PixelBounds& dataWindow, const std::vector<ExrPart>& p,
                           const Metadata& m = {}, const ExrSettings& s = {}) {
        writeExr(*this / "d.exr", {dataWindow, {2, 2}}, p, m, s);
    };
    const PixelBounds all{0, 0, 2, 2};
    EXPECT_THROW(write({0, 0, 0, 2}, {{"p", {{"R", zero}}}}), Error);
    EXPECT_THROW(write(all, {}), Error);
    EXPECT_THROW(write(all, {{"p", {}}}), Error);
    EXPECT_THROW(write(all, {{"p", {{"R", zero}, {"R", zero}}}}), Error);
    EXPECT_THROW(write(all, {{"p", {{"R", zero}}}, {"q", {{"R", zero}}}}), Error);
    EXPECT_THROW(write(all, {{"p", {{"R", zero}}}, {"p", {{"G", zero}}}}), Error);
    EXPECT_THROW(write(all, {{"", {{"R", zero}}}}), Error);
    EXPECT_THROW(write(all, {{"p", {{"", zero}}}}), Error);
    EXPECT_THROW(write(all, {{"p", {{"R", zero}}}}, {{"channels", 1}}), Error); // reserved by OpenEXR
    EXPECT_EQ(fileCount(), 0u);
}

TEST(ExrSettings, WordsAreParsedAndLaterWordsOverride) {
    const ExrSettings s = parseExrSettings("half,dwab:12.5,tiles:32,parts");
    EXPECT_TRUE(s.half && s.isMultiPart);
    EXPECT_EQ(s.compression, ExrSettings::Dwab);
    EXPECT_EQ(s.dwaLevel, 12.5f);
    EXPECT_EQ(s.tileSize, 32);
    const ExrSettings later = parseExrSettings("half,float,tiles,scanlines,parts,single,rle,none");
    EXPECT_FALSE(later.half || later.isMultiPart);
    EXPECT_EQ(later.tileSize, 0);
    EXPECT_EQ(later.compression, ExrSettings::None);
    EXPECT_EQ(parseExrSettings("tiles").tileSize, 64);
}

TEST(ExrSettings, ErrorsForUnknownWordsListTheKnownWords) {
    for (const char* word : {"", "halfs", "half:2", "zip:3", "dwaa:", "dwaa:-1", "dwaa:x", "dwaa:nan",
                             "tiles:0", "tiles:7x", "parts:2", "Half"}) {
        try {
            parseExrSettings(std::string("float,") + word);
            ADD_FAILURE() << word;
        } catch (const Error& e) {
            EXPECT_EQ(e.kind, ErrorKind::Usage);
            EXPECT_EQ(e.what(),
                      "unknown EXR setting \"" + std::string(word) +
                          "\" (known: half, float, none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa, dwab; "
                          "dwaa:LEVEL, dwab:LEVEL; scanlines, tiles, tiles:EDGE; single, parts)");
        }
    }
}

} // namespace
} // namespace strobe
