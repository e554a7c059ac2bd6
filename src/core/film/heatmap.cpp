#include "core/film/heatmap.h"

#include "core/math/hash.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace strobe {

namespace {

Rgb fromSrgb(float r, float g, float b) { return Rgb(decodeSrgb(r), decodeSrgb(g), decodeSrgb(b)); }

/// Returns the color at x in [0,1]: blue, cyan, green, yellow, red.
Rgb falseColor(float x) {
    static constexpr float kStops[5][3] = {
        {.1f, .15f, .75f}, {.1f, .7f, .9f}, {.25f, .8f, .3f}, {.98f, .85f, .2f}, {.85f, .1f, .1f}};
    const float position = std::clamp(x, 0.f, 1.f) * 4;
    const int i = std::min(int(position), 3);
    const float f = position - float(i);
    float srgb[3];
    for (int k = 0; k < 3; ++k)
        srgb[k] = kStops[i][k] + (kStops[i + 1][k] - kStops[i][k]) * f;
    return fromSrgb(srgb[0], srgb[1], srgb[2]);
}

/// Returns a color hashed from an id.
Rgb idColor(float id) {
    const uint64_t h = hashOf(uint64_t(id));
    const auto channel = [&](int shift) { return 0.25f + 0.75f * float((h >> shift) & 255) / 255; };
    return fromSrgb(channel(8), channel(16), channel(24));
}

/// Maps a layer's values to [0,1] for `falseColor`.
struct Scale {
    bool isLogarithmic;
    float max;
    float operator()(float value) const {
        return isLogarithmic ? std::log2(std::max(value, 1.f)) / std::log2(std::max(max, 2.f)) : value / max;
    }
    /// False: the value is shown in black.
    bool contains(float value) const { return isLogarithmic ? value > 0 : value >= 0; }
};

/// A glyph of 3×5 pixels; a row is three bits.
using Glyph = std::array<uint8_t, 5>;
constexpr std::array<Glyph, 10> kDigits = {{{7, 5, 5, 5, 7},
                                            {2, 6, 2, 2, 7},
                                            {7, 1, 7, 4, 7},
                                            {7, 1, 3, 1, 7},
                                            {5, 5, 7, 1, 1},
                                            {7, 4, 7, 1, 7},
                                            {7, 4, 7, 5, 7},
                                            {7, 1, 2, 2, 2},
                                            {7, 5, 7, 5, 7},
                                            {7, 5, 7, 1, 7}}};
constexpr std::array<Glyph, 26> kLetters = {
    {{2, 5, 7, 5, 5}, {6, 5, 6, 5, 6}, {3, 4, 4, 4, 3}, {6, 5, 5, 5, 6}, {7, 4, 6, 4, 7}, {7, 4, 6, 4, 4},
     {3, 4, 5, 5, 3}, {5, 5, 7, 5, 5}, {7, 2, 2, 2, 7}, {1, 1, 1, 5, 2}, {5, 5, 6, 5, 5}, {4, 4, 4, 4, 7},
     {5, 7, 7, 5, 5}, {6, 5, 5, 5, 5}, {2, 5, 5, 5, 2}, {6, 5, 6, 4, 4}, {2, 5, 5, 6, 3}, {6, 5, 6, 5, 5},
     {3, 4, 2, 1, 6}, {7, 2, 2, 2, 2}, {5, 5, 5, 5, 7}, {5, 5, 5, 5, 2}, {5, 5, 7, 7, 5}, {5, 5, 2, 5, 5},
     {5, 5, 2, 2, 2}, {7, 1, 2, 4, 7}}};

/// Returns the glyph of a digit, a small letter, a point or a comma; that of other characters is empty.
Glyph glyphOf(char c) {
    if (c >= '0' && c <= '9')
        return kDigits[size_t(c - '0')];
    if (c >= 'a' && c <= 'z')
        return kLetters[size_t(c - 'a')];
    return c == '.' ? Glyph{0, 0, 0, 0, 2} : c == ',' ? Glyph{0, 0, 0, 2, 4} : Glyph{};
}

// In pixels of the image.
constexpr int kFontZoom = 2;
constexpr int kGlyphAdvance = 4 * kFontZoom;
constexpr int kMargin = 6;
constexpr int kBarHeight = 10;
constexpr int kTextHeight = 5 * kFontZoom;
constexpr int kTitleHeight = kTextHeight + 2 * kMargin;
constexpr int kBarFooterHeight = kBarHeight + kTextHeight + 2 * kMargin;

void drawText(Image& image, int center, int top, const std::string& text) {
    const int textWidth = int(text.size()) * kGlyphAdvance;
    int left = std::clamp(center - textWidth / 2, 0, std::max(image.width - textWidth, 0));
    for (const char c : text) {
        const Glyph glyph = glyphOf(c);
        for (int y = 0; y < 5 * kFontZoom; ++y) {
            for (int x = 0; x < 3 * kFontZoom; ++x) {
                const bool isSet = glyph[size_t(y / kFontZoom)] >> (2 - x / kFontZoom) & 1;
                if (isSet && left + x < image.width)
                    image.at(left + x, top + y) = Rgb(1);
            }
        }
        left += kGlyphAdvance;
    }
}

/// Draws the color bar and its labels into the footer, whose first row is `top`.
void drawColorBar(Image& image, int top, const Scale& scale) {
    const int left = 3 * kMargin, right = image.width - left;
    for (int x = left; x < right; ++x)
        for (int y = 0; y < kBarHeight; ++y)
            image.at(x, top + kMargin + y) = falseColor(float(x - left) / float(right - 1 - left));
    const auto drawLabel = [&](float value, const std::string& text) {
        const int x = left + int(scale(value) * float(right - 1 - left));
        drawText(image, x, top + 2 * kMargin + kBarHeight, text);
    };
    if (scale.isLogarithmic) {
        for (float value = 1; value < scale.max; value *= 4)
            if (value * 2 <= scale.max)
                drawLabel(value, std::to_string(int(value)));
        drawLabel(scale.max, std::to_string(int(scale.max)));
    } else {
        for (const float value : {0.f, scale.max / 2, scale.max})
            drawLabel(value, scale.max < 0.1f ? fmt::format("{:.4f}", value) : fmt::format("{:.2g}", value));
    }
}

/// Returns the scale of a layer: of counts, up to the samples per pixel or to the largest count; of values
/// without a natural limit, up to the largest one.
Scale scaleOf(const Film& film, Aov layer, int samplesPerPixel) {
    const bool isCount = layer == Aov::Shades || layer == Aov::Samples;
    if (!isCount && layer != Aov::SharedWidth && layer != Aov::SharedError)
        return {false, 1};
    const std::vector<float>& plane = film.plane(layer);
    const float largest = *std::max_element(plane.begin(), plane.end());
    if (isCount)
        return {true, std::max(largest, float(std::max(samplesPerPixel, 2)))};
    return {false, largest > 0 ? largest : 1};
}

} // namespace

Image heatmap(const Film& film, Aov layer, int samplesPerPixel) {
    constexpr int kMinWidth = 180; // of the title
    const bool isId = layer == Aov::Cell;
    const Scale scale = scaleOf(film, layer, samplesPerPixel);
    const PixelBounds& pixelBounds = film.pixelBounds();
    Image image;
    image.width = std::max(pixelBounds.width(), kMinWidth);
    image.height = pixelBounds.height() + (isId ? 0 : kBarFooterHeight) + kTitleHeight;
    image.pixels.assign(size_t(image.width) * size_t(image.height), Rgb(0));
    const std::vector<float>& plane = film.plane(layer);
    for (int y = 0; y < pixelBounds.height(); ++y) {
        for (int x = 0; x < pixelBounds.width(); ++x) {
            const float value = plane[size_t(y) * size_t(pixelBounds.width()) + size_t(x)];
            if (isId)
                image.at(x, y) = value != 0 ? idColor(value) : Rgb(0);
            else if (scale.contains(value))
                image.at(x, y) = falseColor(scale(value));
        }
    }
    if (!isId)
        drawColorBar(image, pixelBounds.height(), scale);
    drawText(image, image.width / 2, image.height - kMargin - kTextHeight,
             std::string(aovInfo(layer).name) + (isId                  ? ", hashed"
                                                 : scale.isLogarithmic ? ", logarithmic"
                                                                       : ", linear"));
    return image;
}

} // namespace strobe
