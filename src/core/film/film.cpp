#include "core/film/film.h"

#include "core/util/memory.h"
#include "core/util/parallel.h"

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

void Film::enableAccumulation() {
    const size_t count = m_image.pixels.size();
    m_sums.reserve(count); // huge pages: a slice of a large frame has a third of the page faults
    adviseHugePages(m_sums.data(), count * sizeof(PixelAccumulator));
    m_sums.resize(count);
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

void Film::merge(const Film& other) {
    const PixelBounds& bounds = other.pixelBounds();
    for (int y = bounds.y0; y < bounds.y1; ++y)
        for (int x = bounds.x0; x < bounds.x1; ++x)
            add(x, y, other.m_sums.at(other.index(x, y)));
    m_records.add(other.m_records);
    m_layerRecords.add(other.m_layerRecords);
}

void Film::clear() {
    std::fill(m_image.pixels.begin(), m_image.pixels.end(), Rgb(0));
    std::fill(m_sums.begin(), m_sums.end(), PixelAccumulator());
    for (std::vector<float>& plane : m_planes)
        std::fill(plane.begin(), plane.end(), 0.f);
    m_records.clear();
    m_layerRecords.clear();
}

void Film::moveTo(const PixelBounds& pixelBounds) {
    const size_t count = size_t(pixelBounds.width()) * size_t(pixelBounds.height());
    m_pixelBounds = pixelBounds;
    m_image.width = pixelBounds.width();
    m_image.height = pixelBounds.height();
    m_image.pixels.resize(count);
    if (accumulates())
        m_sums.resize(count);
    for (std::vector<float>& plane : m_planes)
        plane.resize(count);
    clear();
}

void Film::clear(const PixelBounds& tile) {
    for (int y = tile.y0; y < tile.y1; ++y) {
        for (int x = tile.x0; x < tile.x1; ++x) {
            m_sums[index(x, y)] = {};
            m_image.pixels[index(x, y)] = Rgb(0);
        }
    }
    m_records.remove(tile);
    m_layerRecords.remove(tile);
}

bool Film::hasSampleCount(const PixelBounds& tile, uint32_t samples) const {
    for (int y = tile.y0; y < tile.y1; ++y)
        for (int x = tile.x0; x < tile.x1; ++x)
            if (const PixelAccumulator& sum = m_sums[index(x, y)];
                sum.validCount() + sum.invalidCount() < samples)
                return false;
    return true;
}

void Film::copyFrom(const Film& source, const PixelBounds& tile) {
    for (int y = tile.y0; y < tile.y1; ++y) {
        const size_t begin = index(tile.x0, y);
        const auto copyRow = [&](const auto& in, auto& out) {
            std::copy_n(in.begin() + ptrdiff_t(begin), tile.width(), out.begin() + ptrdiff_t(begin));
        };
        copyRow(source.m_image.pixels, m_image.pixels);
        if (!source.m_sums.empty() && !m_sums.empty())
            copyRow(source.m_sums, m_sums);
        for (size_t i = 0; i < m_planes.size(); ++i)
            copyRow(source.m_planes[i], m_planes[i]);
    }
    m_records.copyFrom(source.m_records, tile);
    m_layerRecords.copyFrom(source.m_layerRecords, tile);
}

void Film::addToImage(std::span<const Rgb> values) {
    parallelForRuns(values.size(), [&](size_t i) { m_image.pixels[i] += values[i]; });
}

std::vector<ExrPart> Film::exrParts(const std::vector<ExrPart>& extraParts,
                                    std::span<const float> alpha) const {
    const float* rgb = &m_image.pixels[0].x;
    std::vector<ExrPart> parts = {{"rgba", {{"R", rgb, 3}, {"G", rgb + 1, 3}, {"B", rgb + 2, 3}}}};
    if (!alpha.empty())
        parts[0].channels.push_back({"A", alpha.data()});
    for (size_t i = 0; i < m_layers.size(); ++i) {
        const std::string name = aovInfo(m_layers[i]).name;
        parts.push_back({name, {{name + ".Y", m_planes[i].data(), 1, true}}});
    }
    parts.insert(parts.end(), extraParts.begin(), extraParts.end());
    return parts;
}

void Film::checkWrite(const std::filesystem::path& path, const OutputSettings& settings,
                      const std::vector<ExrPart>& extraParts) const {
    const std::optional<ImageFormat> format = imageFormatOf(path);
    if (!format)
        throw Error("cannot write \"" + path.string() + "\": the name must end in " + imageExtensions(),
                    ErrorKind::Usage);
    if (format == ImageFormat::Exr)
        checkExr(path, exrParts(extraParts, {}), settings.exr);
}

size_t Film::write(const std::filesystem::path& path, const Metadata& metadata,
                   const OutputSettings& settings, const std::vector<ExrPart>& extraParts,
                   std::span<const float> alpha) const {
    checkWrite(path, settings, extraParts);
    const ImageFormat format = *imageFormatOf(path);
    if (format == ImageFormat::Exr)
        return writeExr(path, {m_pixelBounds, {m_fullWidth, m_fullHeight}}, exrParts(extraParts, alpha),
                        metadata, settings.exr, settings.threads);
    Image image = m_image;
    if (hasView(format))
        for (Rgb& color : image.pixels)
            color *= std::exp2(settings.exposure);
    writeImage(path, std::move(image), metadata, settings.view, alpha);
    return 0;
}

} // namespace strobe
