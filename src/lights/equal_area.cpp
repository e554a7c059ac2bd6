#include "lights/equal_area.h"

namespace strobe {

Rgb equalAreaLookup(const Image& image, const V2f& p) {
    const int n = image.width;
    const auto pixel = [&](int x, int y) {
        if (x < 0 || x >= n) {
            x = x < 0 ? -x - 1 : 2 * n - 1 - x;
            y = n - 1 - y;
        }
        if (y < 0 || y >= n) {
            y = y < 0 ? -y - 1 : 2 * n - 1 - y;
            x = n - 1 - x;
        }
        return image.at(std::clamp(x, 0, n - 1), std::clamp(y, 0, n - 1));
    };
    const float px = p.x * float(n) - .5f, py = p.y * float(n) - .5f;
    const int x = int(std::floor(px)), y = int(std::floor(py));
    const float dx = px - float(x), dy = py - float(y);
    return (pixel(x, y) * (1 - dx) + pixel(x + 1, y) * dx) * (1 - dy) +
           (pixel(x, y + 1) * (1 - dx) + pixel(x + 1, y + 1) * dx) * dy;
}

Image toLatitudeLongitude(const Image& equalArea) {
    // Supersampling per axis. Near the equator, pixels of both images cover about the same solid angle.
    constexpr int kSub = 2;
    Image out{2 * equalArea.width, equalArea.width, {}};
    out.pixels.reserve(size_t(out.width) * size_t(out.height));
    for (int y = 0; y < out.height; ++y)
        for (int x = 0; x < out.width; ++x) {
            Rgb sum(0);
            for (int k = 0; k < kSub * kSub; ++k) {
                const float phi = (float(x) + (float(k % kSub) + .5f) / kSub) / float(out.width) * 2 * kPi;
                const float theta = (float(y) + (float(k / kSub) + .5f) / kSub) / float(out.height) * kPi;
                const float s = std::sin(theta);
                sum += equalAreaLookup(
                    equalArea, equalAreaPoint({s * std::cos(phi), s * std::sin(phi), std::cos(theta)}));
            }
            out.pixels.push_back(sum / float(kSub * kSub));
        }
    return out;
}

} // namespace strobe
