#include "core/film/film.h"

#include <algorithm>

namespace strobe {

Film::Film(int fullWidth, int fullHeight, const PixelBounds& pixelBounds, std::vector<Aov> layers)
    : m_fullWidth(fullWidth), m_fullHeight(fullHeight),
      m_pixelBounds(pixelBounds), m_image{pixelBounds.width(), pixelBounds.height(),
                                          std::vector<Rgb>(size_t(pixelBounds.width()) *
                                                               size_t(pixelBounds.height()),
                                                           Rgb(0))},
      m_layers(std::move(layers)), m_planes(m_layers.size(), std::vector<float>(m_image.pixels.size(), 0.f)) {
}

const std::vector<float>& Film::plane(Aov layer) const {
    const auto it = std::find(m_layers.begin(), m_layers.end(), layer);
    return m_planes.at(size_t(it - m_layers.begin()));
}

bool Film::has(Aov layer) const {
    return std::find(m_layers.begin(), m_layers.end(), layer) != m_layers.end();
}

void Film::setPlane(Aov layer, std::vector<float> values) {
    const auto it = std::find(m_layers.begin(), m_layers.end(), layer);
    m_planes.at(size_t(it - m_layers.begin())) = std::move(values);
}

void Film::add(const Film& part) {
    const PixelBounds& w = part.pixelBounds();
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            add(x, y, part.m_sums.at(size_t(y - w.y0) * size_t(w.width()) + size_t(x - w.x0)));
}

void Film::clear() {
    std::fill(m_image.pixels.begin(), m_image.pixels.end(), Rgb(0));
    std::fill(m_sums.begin(), m_sums.end(), PixelAccumulator());
    for (std::vector<float>& plane : m_planes)
        std::fill(plane.begin(), plane.end(), 0.f);
}

void Film::clear(const PixelBounds& tile) {
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x)
            m_sums[index(x, y)] = {}, m_image.pixels[index(x, y)] = Rgb(0);
}

bool Film::holds(const PixelBounds& tile, uint32_t samples) const {
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x)
            if (const PixelAccumulator& sum = m_sums[index(x, y)]; sum.good() + sum.bad() != samples)
                return false;
    return true;
}

void Film::copy(const Film& from, const PixelBounds& tile) {
    for (int y = tile.y0 - m_pixelBounds.y0; y < tile.y1 - m_pixelBounds.y0; ++y) {
        const ptrdiff_t row = ptrdiff_t(y) * m_image.width;
        const ptrdiff_t begin = row + tile.x0 - m_pixelBounds.x0, end = row + tile.x1 - m_pixelBounds.x0;
        const auto take = [&](const auto& in, auto& out) {
            std::copy(in.begin() + begin, in.begin() + end, out.begin() + begin);
        };
        take(from.m_image.pixels, m_image.pixels);
        if (!from.m_sums.empty() && !m_sums.empty())
            take(from.m_sums, m_sums);
        for (size_t i = 0; i < m_planes.size(); ++i)
            take(from.m_planes[i], m_planes[i]);
    }
}

std::vector<ExrPart> Film::exrParts(const std::vector<ExrPart>& more) const {
    const float* data = &m_image.pixels[0].x;
    std::vector<ExrPart> parts = {{"rgba", {{"R", data, 3}, {"G", data + 1, 3}, {"B", data + 2, 3}}}};
    for (size_t i = 0; i < m_layers.size(); ++i) {
        const std::string name = aovInfo(m_layers[i]).name;
        parts.push_back({name, {{name + ".Y", m_planes[i].data(), 1, true}}});
    }
    parts.insert(parts.end(), more.begin(), more.end());
    return parts;
}

void Film::checkWrite(const std::filesystem::path& path, const OutputSettings& settings,
                      const std::vector<ExrPart>& more) const {
    if (path.extension() == ".exr")
        checkExr(path, exrParts(more), settings.exr);
    else if (path.extension() != ".png")
        throw Error("cannot write \"" + path.string() + "\": the name must end in .exr or .png",
                    ErrorKind::Usage);
}

size_t Film::write(const std::filesystem::path& path, const Metadata& metadata,
                   const OutputSettings& settings, const std::vector<ExrPart>& more) const {
    checkWrite(path, settings, more);
    if (path.extension() == ".exr")
        return writeExr(path, {m_pixelBounds, {m_fullWidth, m_fullHeight}}, exrParts(more), metadata,
                        settings.exr, settings.threads);
    Image image = m_image;
    for (Rgb& c : image.pixels)
        c *= std::exp2(settings.exposure);
    writePng(path, std::move(image), metadata, settings.view);
    return 0;
}

} // namespace strobe
