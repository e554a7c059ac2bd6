// The vertices at the outside of a scene.
#pragma once

#include "core/math/math.h"

#include <vector>

namespace strobe::gltf {

/// Of points, keeps the farthest one in each of evenly distributed directions: the convex hull, nearly.
class Extremes {
  public:
    Extremes();
    void add(const V3f& p) {
        for (size_t i = 0; i < m_directions.size(); ++i)
            if (const float d = dot(p, m_directions[i]); d > m_distances[i]) {
                m_distances[i] = d;
                m_points[i] = p;
            }
    }
    /// Returns the points; none if none was added.
    std::vector<V3f> points() const;

  private:
    std::vector<V3f> m_directions, m_points;
    std::vector<float> m_distances;
};

} // namespace strobe::gltf
