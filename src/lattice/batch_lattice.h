// The lattice for the samples of a batch.
#pragma once

#include "lattice/batch_patches.h"

namespace strobe {

/// Finds the lattice points around the samples of a batch, and interpolates their radiance:
///
///     samples -> cells -> lattice points -> shading points -> (radiance of these) -> interpolation
///
/// 1. `begin` starts a batch.
/// 2. `addSamples`, `addChunk` and `addPatch` add samples, chunk by chunk, and find their cells; `finish`
/// ends this.
/// 3. `shadingPoints` are the points of these cells in the samples' time bins. `setValue` is called for each.
/// 4. `interpolate` computes the radiance of the samples.
///
/// Cells, points and values of earlier batches are used again: `shadingPoints` has those without a value
/// only. For one thread.
class BatchLattice {
  public:
    struct Settings {
        int timeBins;
        bool nearest; ///< a sample uses the value of the nearest point, not a weighted mean
        /// Values of earlier batches are used again. Must be false if a point has several values (components
        /// of light).
        bool keepsValues;
    };
    /// `cache` is where the caller looks up shading points: their entries are prefetched. Lattice and cache
    /// must outlive the object.
    BatchLattice(const SurfaceLattice& lattice, const Settings& settings, const RadianceCache& cache);
    BatchLattice(const BatchLattice&) = delete;
    BatchLattice& operator=(const BatchLattice&) = delete;

    /// Removes the samples and shading points of the last batch.
    void begin(const VisibilityBatch& batch);
    /// Adds the samples `indices[0] … indices[count-1]`, in ascending order, of chunk number `chunk` of the
    /// batch.
    void addSamples(const VisibilityBatch& batch, size_t chunk, const int32_t* indices, int count);
    /// Adds all samples of a chunk.
    void addChunk(const VisibilityBatch& batch, size_t chunk);
    /// Adds all samples of a chunk if they are in one patch; else does nothing and returns false. Faster than
    /// addChunk, with the same result.
    bool addPatch(const VisibilityBatch& batch, size_t chunk);
    /// To be called when all samples are added.
    void finish();

    /// In the order of the first requests.
    std::span<const ShadingPoint> shadingPoints() const { return m_batch.shadingPoints.all(); }
    const SurfaceSide& sideOf(const ShadingPoint& p) const { return m_table.point(p.point).side; }
    const LatticePoint& latticePointOf(const ShadingPoint& p) const { return m_table.point(p.point).point; }
    uint32_t timeBinOf(const ShadingPoint& p) const {
        return m_table.groups().pack(m_table.point(p.point).group, p.binInGroup);
    }
    void setValue(const ShadingPoint& p, const Rgb& radiance) {
        m_table.setValue(p.point, p.binInGroup, radiance);
    }

    /// Returns whether a sample of the batch was added.
    bool contains(size_t sample) const { return sourceOf(sample) != kNone; }
    /// Writes the radiance of all samples of the batch; black for those that were not added.
    void interpolate(std::span<Rgb> values) const;
    /// Returns the key of the shading point that has the greatest weight for an added sample.
    uint64_t mainKeyOf(size_t sample) const;

  private:
    struct CellKeySoA;
    struct DistinctHits;
    struct CellsOfHits;
    /// State of one batch.
    struct Batch {
        std::vector<RayCone> pixelCones;
        std::vector<InterpolationSoA> interpolation; ///< by chunk
        ShadingPointList shadingPoints;
        LatticeHitSoA hits;              ///< of samples that were added, but not located yet
        uint32_t sampleOfHit[kSoAWidth]; ///< index in the batch
    };

    void locateHits();
    CellsOfHits findCells(const CellKeySoA& keys, const DistinctHits& distinct);
    void addCells(const CellKeySoA& keys, const int32_t* hits, int count);
    void addTrianglePoints(const CellKeySoA& keys, const uint32_t* cells, TriangleCellSoA& triangles);
    InterpolationTable::PointValues findPoints(int hit, uint32_t group);
    void requestCellPoints(const CellKeySoA& keys, const CellsOfHits& cells);
    void requestNearestPoints(const CellKeySoA& keys, const CellsOfHits& cells);
    void setSources(const CellKeySoA& keys, const CellsOfHits& cells);
    uint32_t sourceOf(size_t sample) const {
        return m_batch.interpolation[sample / kSoAWidth].source[sample % kSoAWidth];
    }

    const SurfaceLattice& m_lattice;
    const Settings m_settings;
    const RadianceCache& m_cache;
    // Used by many batches:
    InterpolationTable m_table;
    SurfaceCache m_surfaces;
    MeshPointCache m_meshPoints;

    Batch m_batch;
    BatchPatches m_patches;
};

} // namespace strobe
