#include "session/error_curve.h"

#include "core/util/atomic_file.h"

#include <fmt/format.h>

namespace strobe {

namespace {

Image cropped(const Image& frame, const PixelBounds& pixelBounds) {
    Image out{pixelBounds.width(), pixelBounds.height(), {}};
    for (int y = pixelBounds.y0; y < pixelBounds.y1; ++y)
        for (int x = pixelBounds.x0; x < pixelBounds.x1; ++x)
            out.pixels.push_back(frame.at(x, y));
    return out;
}

} // namespace

ErrorCurve::ErrorCurve(const std::filesystem::path& reference, const Film& film)
    : m_reference(readImage(reference, {}, ColorEncoding{ColorEncoding::Srgb})) {
    const PixelBounds& w = film.pixelBounds();
    if (m_reference.width == w.width() && m_reference.height == w.height())
        return;
    if (m_reference.width != film.fullWidth() || m_reference.height != film.fullHeight())
        throw Error(fmt::format("--reference {}: it has {}x{} pixels, the picture {}x{}", reference.string(),
                                m_reference.width, m_reference.height, w.width(), w.height()),
                    ErrorKind::Usage);
    m_reference = cropped(m_reference, w);
}

const ErrorCurve::Point& ErrorCurve::add(const Film& film, const RenderStats& stats) {
    double squares = 0, relative = 0;
    const std::vector<Rgb>& pixels = film.image().pixels;
    for (size_t i = 0; i < pixels.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            const double truth = std::clamp(m_reference.pixels[i][c], 0.f, 1.f);
            const double off = std::clamp(pixels[i][c], 0.f, 1.f) - truth;
            squares += off * off, relative += off * off / ((truth + 0.01) * (truth + 0.01));
        }
    const double n = 3 * double(pixels.size());
    return m_points.emplace_back(
        Point{stats.seconds, stats.samplesPerPixel, std::sqrt(squares / n), std::sqrt(relative / n)});
}

void ErrorCurve::write(const std::filesystem::path& file) const {
    std::string text = "seconds,samples,rmse,relative_rmse\n";
    for (const Point& p : m_points)
        text += fmt::format("{:.6f},{},{:.9g},{:.9g}\n", p.seconds, p.samplesPerPixel, p.rmse, p.relative);
    writeFileAtomically(file, text);
}

} // namespace strobe
