#include "session/files/csv_tables.h"

#include "core/util/atomic_file.h"

#include <fmt/format.h>

#include <algorithm>

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

void SampleTable::add(const SampleRecord& r) {
    const Hit& hit = r.sample.hit;
    std::string row = fmt::format("{},{},{},{:.9g},{:.9g},{:.9g},", r.x, r.y, r.number, r.sample.film.x,
                                  r.sample.film.y, r.sample.ray.time);
    if (hit)
        row += fmt::format("{},{},{},", hit.instance == kNone ? -1 : int64_t(hit.instance), hit.geometry,
                           hit.prim);
    else
        row += ",,,";
    row +=
        fmt::format("{},{},{:.9g},{:.9g},{:.9g}\n", r.sharingId, r.shades, r.value.x, r.value.y, r.value.z);
    const std::lock_guard lock(m_mutex);
    m_rows.emplace_back(Key(r.y, r.x, r.number), std::move(row));
}

void SampleTable::write(const std::filesystem::path& file) {
    std::sort(m_rows.begin(), m_rows.end());
    std::string text = "x,y,sample,film_x,film_y,time,instance,geometry,primitive,cell,shades,r,g,b\n";
    for (const auto& [key, row] : m_rows)
        text += row;
    writeFileAtomically(file, text);
}

ErrorCurve::ErrorCurve(const std::filesystem::path& reference, const Film& film)
    : m_reference(readImage(reference, {}, ColorEncoding{ColorEncoding::Srgb})) {
    const PixelBounds& bounds = film.pixelBounds();
    if (m_reference.width == bounds.width() && m_reference.height == bounds.height())
        return;
    if (m_reference.width != film.fullWidth() || m_reference.height != film.fullHeight())
        throw Error(fmt::format("--reference {}: it has {}x{} pixels, the image {}x{}", reference.string(),
                                m_reference.width, m_reference.height, bounds.width(), bounds.height()),
                    ErrorKind::Usage);
    m_reference = cropped(m_reference, bounds);
}

const ErrorCurve::Point& ErrorCurve::add(const Film& film, const RenderStats& stats) {
    double squares = 0;
    double relativeSquares = 0;
    const std::vector<Rgb>& pixels = film.image().pixels;
    for (size_t i = 0; i < pixels.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            const double expected = std::clamp(m_reference.pixels[i][c], 0.f, 1.f);
            const double error = std::clamp(pixels[i][c], 0.f, 1.f) - expected;
            squares += error * error;
            relativeSquares += error * error / ((expected + 0.01) * (expected + 0.01));
        }
    const double n = 3 * double(pixels.size());
    return m_points.emplace_back(
        Point{stats.seconds, stats.samplesPerPixel, std::sqrt(squares / n), std::sqrt(relativeSquares / n)});
}

void ErrorCurve::write(const std::filesystem::path& file) const {
    std::string text = "seconds,samples,rmse,relative_rmse\n";
    for (const Point& p : m_points)
        text += fmt::format("{:.6f},{},{:.9g},{:.9g}\n", p.seconds, p.samplesPerPixel, p.rmse, p.relative);
    writeFileAtomically(file, text);
}

} // namespace strobe
