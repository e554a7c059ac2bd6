#include "lights/environment_map.h"

#include "core/math/simd4.h"

namespace strobe {

/// What lookups read; all of it without branches.
struct EnvironmentMap::View {
    const float *texels, *density;
    int width, height;

    /// A cell between four pixel centers, x in [0, width) and y in [0, height]; the first and last row of
    /// cells are half as high.
    struct Cell {
        int x, y;
        V2f at; ///< in [0,1]² within the cell
    };
    STROBE_FORCE_INLINE float top(int y) const { return std::max(float(y) - .5f, 0.f); } ///< in pixels
    STROBE_FORCE_INLINE float bottom(int y) const {
        return std::min(float(y) + .5f, float(height));
    } ///< in pixels

    STROBE_FORCE_INLINE Cell cellOf(const V3f& w) const {
        const float phi = fastAtan2(w.y, w.x), turns = (phi < 0 ? phi + 2 * kPi : phi) * (kInvPi / 2);
        // atan2 tells directions near the poles apart, where acos does not.
        const float v = fastAtan2(std::sqrt(w.x * w.x + w.y * w.y), w.z) * kInvPi;
        const float px = std::min(turns, kOneMinusEpsilon) * float(width) + .5f;
        const float py = std::min(v, 1.f) * float(height);
        const int x = int(px), y = std::min(std::max(int(py + .5f), 0), height);
        const int wrapped = x >= width ? x - width : x;
        return {std::max(wrapped, 0), y, {px - float(x), (py - top(y)) / (bottom(y) - top(y))}};
    }

    /// Radiance at the corners of a cell, and between.
    struct Corners {
        float r[4], g[4], b[4]; ///< as Bilinear's
        STROBE_FORCE_INLINE Bilinear luminances() const {
            return {luminance({r[0], g[0], b[0]}), luminance({r[1], g[1], b[1]}),
                    luminance({r[2], g[2], b[2]}), luminance({r[3], g[3], b[3]})};
        }
        STROBE_FORCE_INLINE Rgb at(const V2f& p) const {
            return {Bilinear{r[0], r[1], r[2], r[3]}.eval(p), Bilinear{g[0], g[1], g[2], g[3]}.eval(p),
                    Bilinear{b[0], b[1], b[2], b[3]}.eval(p)};
        }
    };
    STROBE_FORCE_INLINE int upperLeft(int x, int y) const { return 3 * (x + (width + 1) * y); }
    STROBE_FORCE_INLINE int perRow() const { return 3 * (width + 1); }
    STROBE_FORCE_INLINE Corners corners(int x, int y) const {
        const int upper = upperLeft(x, y), lower = upper + perRow();
        return {{texels[upper], texels[upper + 3], texels[lower], texels[lower + 3]},
                {texels[upper + 1], texels[upper + 4], texels[lower + 1], texels[lower + 4]},
                {texels[upper + 2], texels[upper + 5], texels[lower + 2], texels[lower + 5]}};
    }
    STROBE_FORCE_INLINE Rgb lookup(const V3f& w, float& pdf) const {
        const Cell cell = cellOf(w);
        const Rgb radiance = corners(cell.x, cell.y).at(cell.at);
        pdf = pdfOf(cell.y, radiance, std::sqrt(w.x * w.x + w.y * w.y));
        return radiance;
    }
    STROBE_FORCE_INLINE float pdfOf(int y, const Rgb& radiance, float sinTheta) const {
        const float scaled = luminance(radiance) * density[y] / sinTheta;
        return sinTheta > 0 ? scaled : 0;
    }
    /// `u`: within the cell.
    STROBE_FORCE_INLINE Sample sampleIn(int x, int y, const Corners& c, const V2f& u) const {
        const V2f at = c.luminances().sample(u);
        const SinCos phi = sinCosOfTurns((float(x) - .5f + at.x) / float(width));
        const SinCos theta = sinCosOfTurns(lerp(top(y), bottom(y), at.y) / float(2 * height));
        const Rgb radiance = c.at(at);
        return {
            {theta.sin * phi.cos, theta.sin * phi.sin, theta.cos}, radiance, pdfOf(y, radiance, theta.sin)};
    }

    struct Lanes;
    static void findCells(const View& view, const V3SoA& w, int n, Lanes& cells);
    static void findFirst(const View& view, int n, Lanes& cells);
    void fetch(int n, Lanes& cells) const;
    static void blend(const Lanes& cells, int n, RgbSoA& radiance);
    static void densities(const View& view, const Lanes& cells, const V3SoA& w, const RgbSoA& radiance, int n,
                          float* pdf);
    static void samples(const View& view, const Lanes& cells, int n, V3SoA& w, RgbSoA& radiance, float* pdf);
};

/// Places in cells, side by side, with what is at the cells' corners.
struct EnvironmentMap::View::Lanes {
    alignas(64) int32_t x[kSoAWidth], y[kSoAWidth];
    V2SoA at;
    alignas(64) int32_t first[kSoAWidth]; ///< number of the upper left corner
    RgbSoA corner[4];

    STROBE_FORCE_INLINE Corners corners(int i) const {
        return {{corner[0].r[i], corner[1].r[i], corner[2].r[i], corner[3].r[i]},
                {corner[0].g[i], corner[1].g[i], corner[2].g[i], corner[3].g[i]},
                {corner[0].b[i], corner[1].b[i], corner[2].b[i], corner[3].b[i]}};
    }
};

STROBE_TARGET_CLONES void EnvironmentMap::View::findCells(const View& view, const V3SoA& w, int n,
                                                          Lanes& cells) {
    const View v = view;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const Cell cell = v.cellOf(w.at(i));
        cells.x[i] = cell.x, cells.y[i] = cell.y;
        cells.at.x[i] = cell.at.x, cells.at.y[i] = cell.at.y;
    }
}

STROBE_TARGET_CLONES void EnvironmentMap::View::findFirst(const View& view, int n, Lanes& cells) {
    const View v = view;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        cells.first[i] = v.upperLeft(cells.x[i], cells.y[i]);
}

/// Fills the corners, four lanes at a time: some more than n, too.
void EnvironmentMap::View::fetch(int n, Lanes& cells) const {
    const int offsets[] = {0, 3, perRow(), perRow() + 3};
    for (int i = n; i < ((n + 3) & ~3); ++i)
        cells.first[i] = 0;
    for (int i = 0; i < n; i += 4)
        for (int k = 0; k < 4; ++k) {
            const float* from = texels + offsets[k];
            const int32_t* first = cells.first + i;
            RgbSoA& to = cells.corner[k];
            storeTransposed(loadFloat4(from + first[0]), loadFloat4(from + first[1]),
                            loadFloat4(from + first[2]), loadFloat4(from + first[3]), to.r + i, to.g + i,
                            to.b + i);
        }
}

STROBE_TARGET_CLONES void EnvironmentMap::View::blend(const Lanes& cells, int n, RgbSoA& radiance) {
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const Rgb c = cells.corners(i).at(cells.at.at(i));
        radiance.r[i] = c.x, radiance.g[i] = c.y, radiance.b[i] = c.z;
    }
}

STROBE_TARGET_CLONES void EnvironmentMap::View::densities(const View& view, const Lanes& cells,
                                                          const V3SoA& w, const RgbSoA& radiance, int n,
                                                          float* pdf) {
    const View v = view;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i)
        pdf[i] = v.pdfOf(cells.y[i], radiance.at(i), std::sqrt(w.x[i] * w.x[i] + w.y[i] * w.y[i]));
}

STROBE_TARGET_CLONES void EnvironmentMap::View::samples(const View& view, const Lanes& cells, int n, V3SoA& w,
                                                        RgbSoA& radiance, float* pdf) {
    const View v = view;
    STROBE_IVDEP
    for (int i = 0; i < n; ++i) {
        const Sample s = v.sampleIn(cells.x[i], cells.y[i], cells.corners(i), cells.at.at(i));
        w.x[i] = s.w.x, w.y[i] = s.w.y, w.z[i] = s.w.z;
        radiance.r[i] = s.radiance.x, radiance.g[i] = s.radiance.y, radiance.b[i] = s.radiance.z;
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
    m_texels.push_back(0);        // they are read by fours
    m_density.resize(size_t(ny)); // not read yet
    const View map = view();
    std::vector<float> flux(size_t(nx) * size_t(ny));
    std::vector<double> share(static_cast<size_t>(ny));
    double sum[3] = {0, 0, 0};
    for (int y = 0; y < ny; ++y) {
        const double scale = kPi / m_height;
        // The cell's height in pixels, by the mean of sinθ over it, as the difference of two cosines.
        share[size_t(y)] = (std::cos(map.top(y) * scale) - std::cos(map.bottom(y) * scale)) / scale;
        for (int x = 0; x < nx; ++x) {
            const View::Corners corners = map.corners(x, y);
            const Rgb middle = corners.at({.5f, .5f});
            flux[size_t(y) * size_t(nx) + size_t(x)] = float(corners.luminances().mean() * share[size_t(y)]);
            for (int c = 0; c < 3; ++c)
                sum[c] += middle[c] * share[size_t(y)];
        }
    }
    const double norm = kPi / 2 / (double(nx) * m_height);
    m_mean = Rgb(float(sum[0] * norm), float(sum[1] * norm), float(sum[2] * norm));
    m_cells = Piecewise2D(flux, uint32_t(nx), uint32_t(ny));
    // A cell is drawn by its flux, and a point in it by its luminance over the cell's mean, which the flux
    // has, too. Cells are equal on the unit square, but rows of the image are `height`, the outer ones
    // halved.
    for (int y = 0; y < ny; ++y) {
        const double stretch = m_height / (double(ny) * (map.bottom(y) - map.top(y)));
        m_density[size_t(y)] = m_cells.integral() > 0
                                   ? float(share[size_t(y)] * stretch / (m_cells.integral() * 2 * kPi * kPi))
                                   : 0;
    }
}

Rgb EnvironmentMap::radiance(const V3f& w) const {
    float unwanted;
    return view().lookup(w, unwanted);
}

float EnvironmentMap::pdf(const V3f& w) const {
    float pdf;
    view().lookup(w, pdf);
    return pdf;
}

EnvironmentMap::Sample EnvironmentMap::sample(const V2f& u) const {
    const Piecewise2D::CellSample place = m_cells.sampleCell(u);
    const int x = int(place.x), y = int(place.y);
    return view().sampleIn(x, y, view().corners(x, y), place.offset);
}

void EnvironmentMap::lookupSoA(const V3SoA& w, int n, RgbSoA& radiance, float* pdf) const {
    const View v = view();
    View::Lanes cells;
    View::findCells(v, w, n, cells);
    View::findFirst(v, n, cells);
    v.fetch(n, cells);
    View::blend(cells, n, radiance);
    if (pdf)
        View::densities(v, cells, w, radiance, n, pdf);
}

void EnvironmentMap::sampleSoA(const V2SoA& u, int n, V3SoA& w, RgbSoA& radiance, float* pdf) const {
    View::Lanes cells;
    Piecewise2D::CellSample places[kSoAWidth];
    m_cells.sampleCellSoA(u, n, places); // searches: each its own way
    for (int i = 0; i < n; ++i) {
        const Piecewise2D::CellSample& place = places[i];
        cells.x[i] = int32_t(place.x), cells.y[i] = int32_t(place.y), cells.at.set(i, place.offset);
    }
    const View v = view();
    View::findFirst(v, n, cells);
    v.fetch(n, cells);
    View::samples(v, cells, n, w, radiance, pdf);
}

} // namespace strobe
