#include "gltf/thicken.h"

#include <algorithm>
#include <cmath>

namespace strobe::gltf {
namespace {

/// The resolution of spheres and of the ends of tubes.
struct Resolution {
    uint32_t sides; ///< around the axis
    uint32_t bands; ///< of a hemisphere
};

/// Returns a coarser resolution for many surfaces, which are small in the image.
Resolution resolutionFor(size_t surfaces) {
    constexpr size_t kMany = 4096;
    return surfaces <= kMany ? Resolution{16, 4} : Resolution{8, 2};
}

/// Returns the vertices of a tube. A sphere has one ring less.
size_t tubeVertices(const Resolution& r) { return 2 + 2 * size_t(r.bands) * r.sides; }

/// Appends spheres and tubes of one radius to a surface.
class Thickener {
  public:
    Thickener(const Resolution& resolution, float radius, ThickSurface& out)
        : m_resolution(resolution), m_radius(radius), m_out(out) {}

    void addSphere(const V3f& center, uint32_t source) {
        addEnd({center, source, -1}, {0, 0, 1});
        closeEnd({center, source, 1}, {0, 0, 1}, m_resolution.bands - 1);
    }
    void addTube(const V3f& a, uint32_t sourceA, const V3f& b, uint32_t sourceB) {
        V3f axis = b - a;
        const float size = std::max({std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)});
        if (!(size > 1e-6f * m_radius))
            return addSphere(a, sourceA);
        axis = normalize(axis / size);
        addEnd({a, sourceA, -1}, axis);
        closeEnd({b, sourceB, 1}, axis, m_resolution.bands);
    }

  private:
    /// A hemisphere.
    struct End {
        V3f center;
        uint32_t source;
        float side; ///< -1: against the axis; 1: along it
    };

    void addVertex(const End& end, const V3f& normal) {
        m_out.positions.push_back(end.center + normal * m_radius);
        m_out.normals.push_back(normal);
        m_out.sources.push_back(end.source);
    }
    uint32_t vertexCount() const { return uint32_t(m_out.positions.size()); }

    /// Adds a ring at `band` bands from the pole.
    void addRing(const End& end, const V3f& axis, uint32_t band) {
        const Frame frame = Frame::fromNormal(axis);
        const float angle = kPi / 2 * float(band) / float(m_resolution.bands);
        for (uint32_t i = 0; i < m_resolution.sides; ++i) {
            const float phi = 2 * kPi * float(i) / float(m_resolution.sides);
            addVertex(end, axis * (end.side * std::cos(angle)) +
                               (frame.s * std::cos(phi) + frame.t * std::sin(phi)) * std::sin(angle));
        }
    }

    /// Adds the quads between the last two rings.
    void connectRings() {
        const uint32_t n = m_resolution.sides, last = vertexCount() - n, former = last - n;
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t k = (i + 1) % n;
            m_out.indices.insert(m_out.indices.end(), {former + i, former + k, last + k});
            m_out.indices.insert(m_out.indices.end(), {former + i, last + k, last + i});
        }
    }

    /// Adds the hemisphere against the axis, from its pole to the equator.
    void addEnd(const End& end, const V3f& axis) {
        const uint32_t pole = vertexCount(), n = m_resolution.sides;
        addVertex(end, -axis);
        addRing(end, axis, 1);
        for (uint32_t i = 0; i < n; ++i)
            m_out.indices.insert(m_out.indices.end(), {pole, pole + 1 + (i + 1) % n, pole + 1 + i});
        for (uint32_t band = 2; band <= m_resolution.bands; ++band) {
            addRing(end, axis, band);
            connectRings();
        }
    }

    /// Adds the hemisphere along the axis, from the ring `firstBand` to the pole.
    void closeEnd(const End& end, const V3f& axis, uint32_t firstBand) {
        for (uint32_t band = firstBand; band >= 1; --band) {
            addRing(end, axis, band);
            connectRings();
        }
        const uint32_t pole = vertexCount(), n = m_resolution.sides, ring = pole - n;
        addVertex(end, axis);
        for (uint32_t i = 0; i < n; ++i)
            m_out.indices.insert(m_out.indices.end(), {pole, ring + i, ring + (i + 1) % n});
    }

    const Resolution m_resolution;
    const float m_radius;
    ThickSurface& m_out;
};

} // namespace

size_t thickVertexCount(size_t points, size_t segments) {
    const Resolution r = resolutionFor(points + segments);
    return points * (tubeVertices(r) - r.sides) + segments * tubeVertices(r);
}

ThickSurface thicken(const std::vector<V3f>& points, const std::vector<uint32_t>& isolated,
                     const std::vector<Segment>& segments, float radius) {
    ThickSurface out;
    Thickener thickener(resolutionFor(isolated.size() + segments.size()), radius, out);
    for (const uint32_t i : isolated)
        thickener.addSphere(points[i], i);
    for (const auto& [a, b] : segments)
        thickener.addTube(points[a], a, points[b], b);
    return out;
}

} // namespace strobe::gltf
