// The shading points whose radiance a batch requests.
#pragma once

#include "lattice/interpolation_table.h"
#include "lattice/radiance_cache.h"
#include "lattice/surface_lattice.h"

namespace strobe {

/// A lattice point in a time bin: the unit that is shaded and cached.
struct ShadingPoint {
    uint64_t key;               ///< SurfaceLattice::keyOf
    uint32_t point, binInGroup; ///< in an InterpolationTable
    uint32_t sample;            ///< of the batch: one that requested it
};

/// The shading points that a batch requests, without duplicates, in the order of the first requests.
class ShadingPointList {
  public:
    size_t size() const { return m_count; }
    std::span<const ShadingPoint> all() const { return {m_points.data(), m_count}; }
    void clear() { m_count = 0; }
    /// Reserves space for `count` more.
    void reserve(size_t count) {
        if (m_points.size() < m_count + count)
            m_points.resize(2 * (m_count + count));
    }
    /// Appends a shading point unless it was requested since the table was cleared. Precondition: space is
    /// reserved. Branch-free, because whether it was is unpredictable.
    void request(InterpolationTable& table, uint32_t point, uint32_t binInGroup, uint32_t sample) {
        uint32_t& requestedBins = table.point(point).requestedBins;
        m_points[m_count] = {0, point, binInGroup, sample};
        m_count += !(requestedBins >> binInGroup & 1);
        requestedBins |= 1u << binInGroup;
    }
    /// Computes the keys of points from number `first` on, and prefetches their entries in the cache.
    void computeKeys(size_t first, const InterpolationTable& table, const RadianceCache& cache) {
        for (size_t i = first; i < m_count; ++i) {
            ShadingPoint& shadingPoint = m_points[i];
            const InterpolationTable::Point& p = table.point(shadingPoint.point);
            shadingPoint.key =
                SurfaceLattice::keyOf(p.point, table.groups().pack(p.group, shadingPoint.binInGroup));
            cache.prefetch(shadingPoint.key);
        }
    }

  private:
    std::vector<ShadingPoint> m_points; ///< with spare space
    size_t m_count = 0;
};

} // namespace strobe
