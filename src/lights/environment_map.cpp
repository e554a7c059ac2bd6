#include "lights/environment_map.h"

#include "core/math/simd4.h"

namespace strobe {

/// The data of lookups as plain pointers, with branch-free functions for vectorized loops.
struct EnvironmentMap::View {
    const float *texels, *density;
    int width, height;

    /// A point in a cell between four pixel centers: x in [0, width), y in [0, height]. The first and last
    /// row of cells have half the height of the others.
    struct CellPoint {
        int x, y;
        V2f offset; ///< in [0,1]² within the cell
    };
    /// Upper and lower edge of a row of cells, in pixels.
    STROBE_FORCE_INLINE float top(int y) const { return std::max(float(y) - .5f, 0.f); }
    STROBE_FORCE_INLINE float bottom(int y) const { return std::min(float(y) + .5f, float(height)); }

    STROBE_FORCE_INLINE CellPoint cellPoint(const V3f& w) const {
        const float phi = fastAtan2(w.y, w.x), turns = (phi < 0 ? phi + 2 * kPi : phi) * (kInvPi / 2);
        // atan2 resolves directions near the poles, acos does not.
        const float v = fastAtan2(std::sqrt(w.x * w.x + w.y * w.y), w.z) * kInvPi;
        const float px = std::min(turns, kOneMinusEpsilon) * float(width) + .5f;
        const float py = std::min(v, 1.f) * float(height);
        const int x = int(px), y = std::min(std::max(int(py + .5f), 0), height);
        const int wrapped = x >= width ? x - width : x;
        return {std::max(wrapped, 0), y, {px - float(x), (py - top(y)) / (bottom(y) - top(y))}};
    }

    /// Radiance at the corners of a cell, in the order of Bilinear.
    struct Corners {
        float r[4], g[4], b[4];
        STROBE_FORCE_INLINE Bilinear luminances() const {
            return {luminance({r[0], g[0], b[0]}), luminance({r[1], g[1], b[1]}),
                    luminance({r[2], g[2], b[2]}), luminance({r[3], g[3], b[3]})};
        }
        STROBE_FORCE_INLINE Rgb at(const V2f& p) const {
            return {Bilinear{r[0], r[1], r[2], r[3]}.eval(p), Bilinear{g[0], g[1], g[2], g[3]}.eval(p),
                    Bilinear{b[0], b[1], b[2], b[3]}.eval(p)};
        }
    };
    /// Returns the index in `texels` of the upper left corner of a cell.
    STROBE_FORCE_INLINE int upperLeft(int x, int y) const { return 3 * (x + (width + 1) * y); }
    STROBE_FORCE_INLINE int perRow() const { return 3 * (width + 1); }
    STROBE_FORCE_INLINE Corners corners(int x, int y) const {
        const int upper = upperLeft(x, y), lower = upper + perRow();
        return {{texels[upper], texels[upper + 3], texels[lower], texels[lower + 3]},
                {texels[upper + 1], texels[upper + 4], texels[lower + 1], texels[lower + 4]},
                {texels[upper + 2], texels[upper + 5], texels[lower + 2], texels[lower + 5]}};
    }
    STROBE_FORCE_INLINE Rgb lookup(const V3f& w, float& pdf) const {
        const CellPoint cell = cellPoint(w);
        const Rgb radiance = corners(cell.x, cell.y).at(cell.offset);
        pdf = pdfOf(cell.y, radiance, std::sqrt(w.x * w.x + w.y * w.y));
        return radiance;
    }
    STROBE_FORCE_INLINE float pdfOf(int y, const Rgb& radiance, float sinTheta) const {
        const float scaled = luminance(radiance) * density[y] / sinTheta;
        return sinTheta > 0 ? scaled : 0;
    }
    /// Draws a direction in a cell with a density proportional to the luminance; u in [0,1)².
    STROBE_FORCE_INLINE Sample sampleCell(int x, int y, const Corners& c, const V2f& u) const {
        const V2f offset = c.luminances().sample(u);
        const SinCos phi = sinCosOfTurns((float(x) - .5f + offset.x) / float(width));
        const SinCos theta = sinCosOfTurns(lerp(top(y), bottom(y), offset.y) / float(2 * height));
        const Rgb radiance = c.at(offset);
        return {
            {theta.sin * phi.cos, theta.sin * phi.sin, theta.cos}, radiance, pdfOf(y, radiance, theta.sin)};
    }

    // The stages of lookupSoA and sampleSoA.
    struct CellSoA;
    static void findCells(const View& view, const V3SoA& w, int n, CellSoA& cells);
    static void findUpperLeft(const View& view, int n, CellSoA& cells);
    void loadCorners(int n, CellSoA& cells) const;
    static void interpolate(const CellSoA& cells, int n, RgbSoA& radiance);
    static void evalPdfs(const View& view, const CellSoA& cells, const V3SoA& w, const RgbSoA& radiance,
                         int n, float* pdf);
    static void sampleCells(const View& view, const CellSoA& cells, int n, V3SoA& w, RgbSoA& radiance,
                            float* pdf);
};

/// Points in cells, with the radiance at the corners of the cells.
struct EnvironmentMap::View::CellSoA {
    alignas(64) int32_t x[kSoAWidth], y[kSoAWidth];
    V2SoA offset;                             ///< within the cell; for sampling: random numbers in [0,1)²
    alignas(64) int32_t upperLeft[kSoAWidth]; ///< index in `texels`
    RgbSoA corner[4];

    STROBE_FORCE_INLINE Corners corners(int i) const {
        return {{corner[0].r[i], corner[1].r[i], corner[2].r[i], corner[3].r[i]},
                {corner[0].g[i], corner[1].g[i], corner[2].g[i], corner[3].g[i]},
                {corner[0].b[i], corner[1].b[i], corner[2].b[i], corner[3].b[i]}};
    }
};

STROBE_TARGET_CLONES void EnvironmentMap::View::findCells(const View& view, const V3SoA& w, int n,
                                                          CellSoA& cells) {
    const View v = view;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const CellPoint cell = v.cellPoint(w.at(i));
        cells.x[i] = cell.x;
        cells.y[i] = cell.y;
        cells.offset.x[i] = cell.offset.x;
        cells.offset.y[i] = cell.offset.y;
    }
}

STROBE_TARGET_CLONES void EnvironmentMap::View::findUpperLeft(const View& view, int n, CellSoA& cells) {
    const View v = view;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        cells.upperLeft[i] = v.upperLeft(cells.x[i], cells.y[i]);
}

/// Loads the corners, four elements at a time, so that up to three elements beyond n are written.
void EnvironmentMap::View::loadCorners(int n, CellSoA& cells) const {
    const int offsets[] = {0, 3, perRow(), perRow() + 3};
    for (int i = n; i < ((n + 3) & ~3); ++i)
        cells.upperLeft[i] = 0;
    for (int i = 0; i < n; i += 4)
        for (int k = 0; k < 4; ++k) {
            const float* source = texels + offsets[k];
            const int32_t* index = cells.upperLeft + i;
            RgbSoA& corner = cells.corner[k];
            storeTransposed(loadFloat4(source + index[0]), loadFloat4(source + index[1]),
                            loadFloat4(source + index[2]), loadFloat4(source + index[3]), corner.r + i,
                            corner.g + i, corner.b + i);
        }
}

STROBE_TARGET_CLONES void EnvironmentMap::View::interpolate(const CellSoA& cells, int n, RgbSoA& radiance) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const Rgb c = cells.corners(i).at(cells.offset.at(i));
        radiance.r[i] = c.x;
        radiance.g[i] = c.y;
        radiance.b[i] = c.z;
    }
}

STROBE_TARGET_CLONES void EnvironmentMap::View::evalPdfs(const View& view, const CellSoA& cells,
                                                         const V3SoA& w, const RgbSoA& radiance, int n,
                                                         float* pdf) {
    const View v = view;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        pdf[i] = v.pdfOf(cells.y[i], radiance.at(i), std::sqrt(w.x[i] * w.x[i] + w.y[i] * w.y[i]));
}

STROBE_TARGET_CLONES void EnvironmentMap::View::sampleCells(const View& view, const CellSoA& cells, int n,
                                                            V3SoA& w, RgbSoA& radiance, float* pdf) {
    const View v = view;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const Sample s = v.sampleCell(cells.x[i], cells.y[i], cells.corners(i), cells.offset.at(i));
        w.x[i] = s.w.x;
        w.y[i] = s.w.y;
        w.z[i] = s.w.z;
        radiance.r[i] = s.radiance.x;
        radiance.g[i] = s.radiance.y;
        radiance.b[i] = s.radiance.z;
        pdf[i] = s.pdf;
    }
}

EnvironmentMap::View EnvironmentMap::view() const {
    return {m_texels.data(), m_density.data(), m_width, m_height};
}

EnvironmentMap::EnvironmentMap(const Image& image) : m_width(image.width), m_height(image.height) {
    const int nx = m_width, ny = m_height + 1;
    for (int y = -1; y <= m_height; ++y)
        for (int x = -1; x < m_width; ++x) {
            const Rgb& c = image.at((x + m_width) % m_width, std::clamp(y, 0, m_height - 1));
            m_texels.insert(m_texels.end(), {c.x, c.y, c.z});
        }
    m_texels.push_back(0);        // texels are loaded as Float4
    m_density.resize(size_t(ny)); // filled below
    const View map = view();
    std::vector<float> flux(size_t(nx) * size_t(ny));
    std::vector<double> rowWeight(static_cast<size_t>(ny));
    double sum[3] = {0, 0, 0};
    for (int y = 0; y < ny; ++y) {
        const double scale = kPi / m_height;
        // The height of the cell in pixels times the mean of sinθ over it, as a difference of cosines.
        rowWeight[size_t(y)] = (std::cos(map.top(y) * scale) - std::cos(map.bottom(y) * scale)) / scale;
        for (int x = 0; x < nx; ++x) {
            const View::Corners corners = map.corners(x, y);
            const Rgb middle = corners.at({.5f, .5f});
            flux[size_t(y) * size_t(nx) + size_t(x)] =
                float(corners.luminances().mean() * rowWeight[size_t(y)]);
            for (int c = 0; c < 3; ++c)
                sum[c] += middle[c] * rowWeight[size_t(y)];
        }
    }
    const double norm = kPi / 2 / (double(nx) * m_height);
    m_mean = Rgb(float(sum[0] * norm), float(sum[1] * norm), float(sum[2] * norm));
    m_cells = Piecewise2D(flux, uint32_t(nx), uint32_t(ny));
    // A cell is drawn by its flux, and a point in it by its luminance over the mean luminance of the cell,
    // which is a factor of the flux and cancels. Piecewise2D gives all rows of cells the same height;
    // `stretch` is that height over the height of the row in the image, which is halved for the first and
    // last row.
    for (int y = 0; y < ny; ++y) {
        const double stretch = m_height / (double(ny) * (map.bottom(y) - map.top(y)));
        m_density[size_t(y)] =
            m_cells.integral() > 0
                ? float(rowWeight[size_t(y)] * stretch / (m_cells.integral() * 2 * kPi * kPi))
                : 0;
    }
}

Rgb EnvironmentMap::radiance(const V3f& w) const {
    float ignoredPdf;
    return view().lookup(w, ignoredPdf);
}

float EnvironmentMap::pdf(const V3f& w) const {
    float pdf;
    view().lookup(w, pdf);
    return pdf;
}

EnvironmentMap::Sample EnvironmentMap::sample(const V2f& u) const {
    const Piecewise2D::CellSample cell = m_cells.sampleCell(u);
    const int x = int(cell.x), y = int(cell.y);
    return view().sampleCell(x, y, view().corners(x, y), cell.offset);
}

void EnvironmentMap::lookupSoA(const V3SoA& w, int n, RgbSoA& radiance, float* pdf) const {
    const View v = view();
    View::CellSoA cells;
    View::findCells(v, w, n, cells);
    View::findUpperLeft(v, n, cells);
    v.loadCorners(n, cells);
    View::interpolate(cells, n, radiance);
    if (pdf)
        View::evalPdfs(v, cells, w, radiance, n, pdf);
}

void EnvironmentMap::sampleSoA(const V2SoA& u, int n, V3SoA& w, RgbSoA& radiance, float* pdf) const {
    View::CellSoA cells;
    Piecewise2D::CellSample sampled[kSoAWidth];
    m_cells.sampleCellSoA(u, n, sampled); // a search, which does not vectorize
    for (int i = 0; i < n; ++i) {
        cells.x[i] = int32_t(sampled[i].x);
        cells.y[i] = int32_t(sampled[i].y);
        cells.offset.set(i, sampled[i].offset);
    }
    const View v = view();
    View::findUpperLeft(v, n, cells);
    v.loadCorners(n, cells);
    View::sampleCells(v, cells, n, w, radiance, pdf);
}

} // namespace strobe
