#include "gltf/extremes.h"

namespace strobe::gltf {

Extremes::Extremes() {
    constexpr int kCount = 96;
    constexpr float kGoldenAngle = 2.39996323f;
    for (int i = 0; i < kCount; ++i) {
        const float z = 1 - (2 * float(i) + 1) / kCount, r = std::sqrt(1 - z * z);
        m_directions.emplace_back(r * std::cos(kGoldenAngle * float(i)),
                                  r * std::sin(kGoldenAngle * float(i)), z);
    }
    m_points.resize(m_directions.size());
    m_distances.assign(m_directions.size(), -kInfinity);
}

std::vector<V3f> Extremes::points() const {
    return m_distances.front() > -kInfinity ? m_points : std::vector<V3f>();
}

} // namespace strobe::gltf
