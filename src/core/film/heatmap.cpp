#include "core/film/heatmap.h"

#include "core/math/hash.h"

#include <array>
#include <cmath>

namespace strobe {

namespace {

Rgb fromSrgb(float r, float g, float b) { return Rgb(decodeSrgb(r), decodeSrgb(g), decodeSrgb(b)); }

/// Blue, cyan, green, yellow, red for x from 0 to 1.
Rgb falseColor(float x) {
    static constexpr float kStops[5][3] = {
        {.1f, .15f, .75f}, {.1f, .7f, .9f}, {.25f, .8f, .3f}, {.98f, .85f, .2f}, {.85f, .1f, .1f}};
    const float at = std::clamp(x, 0.f, 1.f) * 4;
    const int i = std::min(int(at), 3);
    const float f = at - float(i);
    float c[3];
    for (int k = 0; k < 3; ++k)
        c[k] = kStops[i][k] + (kStops[i + 1][k] - kStops[i][k]) * f;
    return fromSrgb(c[0], c[1], c[2]);
}

Rgb ownColor(float number) {
    const uint64_t h = hashOf(uint64_t(number));
    const auto part = [&](int shift) { return 0.25f + 0.75f * float((h >> shift) & 255) / 255; };
    return fromSrgb(part(8), part(16), part(24));
}

/// How a layer's values become places on the color scale.
struct Scale {
    bool logarithmic;
    float top;
    float placeOf(float value) const {
        return logarithmic ? std::log2(std::max(value, 1.f)) / std::log2(std::max(top, 2.f)) : value / top;
    }
    /// Absent or none: shown black.
    bool has(float value) const { return logarithmic ? value > 0 : value >= 0; }
};

/// Digits and the point, three by five: a row is three bits.
constexpr std::array<std::array<uint8_t, 5>, 11> kGlyphs = {{{7, 5, 5, 5, 7},
                                                             {2, 6, 2, 2, 7},
                                                             {7, 1, 7, 4, 7},
                                                             {7, 1, 3, 1, 7},
                                                             {5, 5, 7, 1, 1},
                                                             {7, 4, 7, 1, 7},
                                                             {7, 4, 7, 5, 7},
                                                             {7, 1, 2, 2, 2},
                                                             {7, 5, 7, 5, 7},
                                                             {7, 5, 7, 1, 7},
                                                             {0, 0, 0, 0, 2}}};
constexpr int kZoom = 2, kAdvance = 4 * kZoom, kMargin = 6, kBar = 10,
              kFooter = kBar + 6 * kZoom + 3 * kMargin;

void drawText(Image& image, int center, int top, const std::string& text) {
    int left = std::clamp(center - int(text.size()) * kAdvance / 2, 0,
                          std::max(image.width - int(text.size()) * kAdvance, 0));
    for (const char c : text) {
        const auto& glyph = kGlyphs[c == '.' ? 10 : size_t(c - '0')];
        for (int y = 0; y < 5 * kZoom; ++y)
            for (int x = 0; x < 3 * kZoom; ++x)
                if (glyph[size_t(y / kZoom)] >> (2 - x / kZoom) & 1 && left + x < image.width)
                    image.at(left + x, top + y) = Rgb(1);
        left += kAdvance;
    }
}

void drawScale(Image& image, int top, const Scale& scale) {
    const int left = 3 * kMargin, right = image.width - left;
    for (int x = left; x < right; ++x)
        for (int y = 0; y < kBar; ++y)
            image.at(x, top + kMargin + y) = falseColor(float(x - left) / float(right - 1 - left));
    const auto label = [&](float value, const std::string& text) {
        const int x = left + int(scale.placeOf(value) * float(right - 1 - left));
        drawText(image, x, top + 2 * kMargin + kBar, text);
    };
    if (scale.logarithmic) {
        for (float value = 1; value < scale.top; value *= 4)
            if (value * 2 <= scale.top)
                label(value, std::to_string(int(value)));
        label(scale.top, std::to_string(int(scale.top)));
    } else {
        label(0, "0");
        label(0.5f, "0.5");
        label(1, "1");
    }
}

} // namespace

Image heatmap(const Film& film, Aov layer, int samplesPerPixel) {
    constexpr int kLeastWidth = 160;
    const bool colorsOnly = layer == Aov::Cell;
    const bool counts = layer == Aov::Shades || layer == Aov::Samples;
    const Scale scale{counts, counts ? float(std::max(samplesPerPixel, 2)) : 1};
    const PixelBounds& pixelBounds = film.pixelBounds();
    Image image;
    image.width = std::max(pixelBounds.width(), colorsOnly ? 0 : kLeastWidth);
    image.height = pixelBounds.height() + (colorsOnly ? 0 : kFooter);
    image.pixels.assign(size_t(image.width) * size_t(image.height), Rgb(0));
    const std::vector<float>& plane = film.plane(layer);
    for (int y = 0; y < pixelBounds.height(); ++y)
        for (int x = 0; x < pixelBounds.width(); ++x) {
            const float value = plane[size_t(y) * size_t(pixelBounds.width()) + size_t(x)];
            Rgb& pixel = image.at(x, y);
            if (colorsOnly)
                pixel = value != 0 ? ownColor(value) : Rgb(0);
            else if (scale.has(value))
                pixel = falseColor(scale.placeOf(value));
        }
    if (!colorsOnly)
        drawScale(image, pixelBounds.height(), scale);
    return image;
}

} // namespace strobe
