#include "sharing/errors/highlights.h"

#include "core/math/math.h"

#include <algorithm>

namespace strobe {

float Highlights::kept(size_t pixel) const {
    constexpr int kReach = 8;   // of the window, in pixels
    constexpr double kLoss = 8; // an eighth of the contrast counts as the bias of the estimates (measured)
    const int px = int(pixel % size_t(m_width)), py = int(pixel / size_t(m_width));
    const int x0 = std::max(px - kReach, 0), x1 = std::min(px + kReach, m_width - 1);
    const int y0 = std::max(py - kReach, 0), y1 = std::min(py + kReach, m_height - 1);
    double products = 0, squaredProducts = 0, noise = 0, first = 0, second = 0;
    for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) {
            const auto& light = m_light[size_t(y) * size_t(m_width) + size_t(x)];
            const double a = double(light[0]), b = double(light[1]);
            products += a * b;
            squaredProducts += sqr(a * b);
            noise += sqr(a - b) / 4; // of the mean of both halves
            first += a;
            second += b;
        }
    const double contrast = products - first * second / ((x1 - x0 + 1) * (y1 - y0 + 1));
    // Bright samples of both halves meet in a pixel by chance, too: the contrast is 0 in the mean then, and
    // its variance is about the sum of the squared products.
    if (!(contrast > 0 && sqr(contrast) > squaredProducts))
        return 0;
    return float(contrast / (contrast + kLoss * noise) * (1 - squaredProducts / sqr(contrast)));
}

} // namespace strobe
