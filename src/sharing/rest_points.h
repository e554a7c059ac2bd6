// Surface points at rest, that is at shutter fraction 0.
#pragma once

#include "core/render/batch.h"
#include "core/render/shader.h"
#include "core/scene/scene.h"

namespace strobe {

/// Returns whether the surface of a hit does not move while the shutter is open.
inline bool isStatic(const Scene& scene, const Hit& hit) {
    const PlacedShape& placed = scene.geometry(hit).placed;
    return placed.isStatic() && (hit.instance == kNone || scene.instances()[hit.instance].motion->isStatic());
}

/// Finds out whether hits are on static surfaces. Caches the result for the surface of the last hit.
class StaticHits {
  public:
    explicit StaticHits(const Scene& scene) : m_scene(scene) {}
    bool contain(const Hit& hit) {
        if (hit.geometry != m_geometry || hit.instance != m_instance) {
            m_geometry = hit.geometry;
            m_instance = hit.instance;
            m_isStatic = isStatic(m_scene, hit);
        }
        return m_isStatic;
    }

  private:
    const Scene& m_scene;
    uint32_t m_geometry = kNone, m_instance = kNone;
    bool m_isStatic = true;
};

/// Hits on moving surfaces, up to kSoAWidth, whose points at rest are needed.
class MovingHits {
  public:
    /// Adds a hit, with an index of the caller's.
    void add(const Hit& hit, int index) {
        m_hits.set(m_count, hit);
        m_indices[m_count++] = index;
    }
    /// Calls work(index, point) with the surface point of each hit at shutter fraction 0.
    template <class Work>
    void forEachAtRest(const Scene& scene, const Work& work) const {
        if (m_count == 0)
            return;
        alignas(64) static constexpr float kAtRest[kSoAWidth] = {};
        SurfaceSoA rest;
        scene.rawSurfaces(m_hits, kAtRest, m_count, rest);
        for (int k = 0; k < m_count; ++k) {
            RawSurfacePoint point = rest.at(k);
            point.finish();
            work(m_indices[k], point);
        }
    }

  private:
    HitSoA m_hits;
    int m_indices[kSoAWidth], m_count = 0;
};

/// Returns the shading normal of a vertex as if its surface rests, on the side of the viewer. A mapped normal
/// turns with the surface. `rest`: the completed surface point at shutter fraction 0.
V3f shadingNormalAtRest(const FirstVertex& vertex, const RawSurfacePoint& rest);

/// Returns the surface of a point with a mapped normal: `surface`, or one of its own for each group of
/// normals that are tilted alike, so that slopes of a bump map that are narrower than a cell do not share
/// light with what is around them. `n`, `ns`: the geometric and the shading normal at rest.
uint64_t surfaceOfTilt(uint64_t surface, const V3f& n, const V3f& ns);

/// Measures how far samples of pixels spread over surfaces at rest.
class PixelSpread {
  public:
    explicit PixelSpread(const Scene& scene) : m_scene(scene) {}
    /// Returns the mean distance at rest of consecutive camera hits of a pixel on the same surface, relative
    /// to the width of the pixel's cone at the hits; 0 if there are none. It depends on the first samples of
    /// the pixel only. Precondition: batch.slice has all samples of the pixel.
    float of(const VisibilityBatch& batch, uint32_t pixel) const;

  private:
    struct Points;
    void replaceMoving(const VisibilityBatch& batch, uint32_t firstSample, Points& points) const;
    const Scene& m_scene;
};

} // namespace strobe
