#include "core/film/film.h"

#include <gtest/gtest.h>

namespace strobe {
namespace {

FilmRecord record(const PixelBounds& pixels, const char* text) { return {pixels, {0, 1}, std::string(text)}; }

std::string textOf(const FilmRecords& records) {
    std::string text;
    for (const FilmRecord& one : records.all())
        text += one.bytes.view();
    return text;
}

TEST(FilmRecords, AreOrderedByPixels) {
    FilmRecords records;
    EXPECT_TRUE(records.isEmpty());
    records.add(record({4, 0, 8, 4}, "b"));
    records.add(record({0, 4, 4, 8}, "c"));
    records.add(record({0, 0, 4, 4}, "a"));
    EXPECT_EQ(textOf(records), "abc");
}

TEST(FilmRecords, OnlyRecordsWithinATileAreCopiedAndRemoved) {
    FilmRecords source, copy;
    source.setNote("note");
    source.add(record({0, 0, 4, 4}, "a"));
    source.add(record({4, 0, 8, 4}, "b"));
    source.add(record({4, 0, 6, 2}, "c"));
    source.add(record({2, 2, 6, 6}, "d"));
    copy.add(record({4, 0, 8, 4}, "old"));
    copy.copyFrom(source, {4, 0, 8, 4});
    EXPECT_EQ(textOf(copy), "bc");
    EXPECT_EQ(copy.note(), "note");
    source.remove({0, 0, 6, 4});
    EXPECT_EQ(textOf(source), "bd");
}

TEST(FilmRecords, BelongToTheFilm) {
    const PixelBounds bounds{0, 0, 8, 8};
    Film film(8, 8, bounds);
    film.enableAccumulation();
    film.records().setNote("note");
    film.records().add(record({0, 0, 4, 4}, "a"));
    Film other = film;
    other.clear();
    EXPECT_TRUE(other.records().isEmpty());
    EXPECT_EQ(other.records().note(), "note");
    other.records().add(record({4, 0, 8, 4}, "b"));
    film.merge(other);
    EXPECT_EQ(textOf(film.records()), "ab");
    film.clear({4, 0, 8, 8});
    EXPECT_EQ(textOf(film.records()), "a");
    other.copyFrom(film, bounds);
    EXPECT_EQ(textOf(other.records()), "a");
}

TEST(Film, MovesToOtherPixelBounds) {
    Film film(64, 64, {0, 0, 8, 8}, {Aov::Depth});
    PixelAccumulator sum;
    sum.add(Rgb(1, 2, 3), 1);
    film.add(1, 2, sum);
    film.setLayerValue(0, 1, 2, 5);
    film.moveTo({32, 16, 36, 32});
    EXPECT_EQ(film.pixelBounds(), (PixelBounds{32, 16, 36, 32}));
    EXPECT_EQ(film.image().pixels, std::vector<Rgb>(64, Rgb(0)));
    EXPECT_EQ(film.plane(Aov::Depth), std::vector<float>(64, 0.f));
    film.add(35, 31, sum);
    EXPECT_EQ(film.image().pixels.back(), Rgb(1, 2, 3));
}

} // namespace
} // namespace strobe
