#include "core/render/timed_shader.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace strobe {

namespace {

/// The maximum number of shades that are timed together. Their rays are traced about as efficiently as those
/// of a whole batch.
constexpr size_t kPacketSize = 16;

} // namespace

TimedShader::TimedShader(const Scene& scene, std::unique_ptr<ShaderWorker> worker, size_t components)
    : m_scene(scene), m_worker(std::move(worker)), m_components(components),
      m_packetRadiance(kPacketSize * (1 + components)), m_packetVertices(kPacketSize) {}

void TimedShader::shade(const ShadingRequests& requests, const ShadeOutput& out, Counters& counters) {
    const uint32_t batch = m_batchCount++;
    const bool isPowerOf16 = std::has_single_bit(batch) && std::countr_zero(batch) % 4 == 0;
    if (batch > 0 && (batch % m_interval == 0 || isPowerOf16))
        shadeTimed(requests, out, counters);
    else
        m_worker->shade(requests, out, counters);
}

uint32_t TimedShader::costIndex(const Hit& hit) const {
    return uint32_t(hit ? size_t(m_scene.geometry(hit).material) : m_scene.materials().size());
}

void TimedShader::sortByMaterial(const ShadingRequests& requests) {
    m_order.resize(requests.size());
    std::iota(m_order.begin(), m_order.end(), 0u);
    m_costIndices.resize(requests.size());
    for (size_t i = 0; i < requests.size(); ++i)
        m_costIndices[i] = costIndex(requests[i].hit);
    std::stable_sort(m_order.begin(), m_order.end(),
                     [&](uint32_t a, uint32_t b) { return m_costIndices[a] < m_costIndices[b]; });
}

void TimedShader::shadeTimed(const ShadingRequests& requests, const ShadeOutput& out, Counters& counters) {
    using Clock = std::chrono::steady_clock;
    sortByMaterial(requests);
    for (size_t first = 0; first < m_order.size(); first += m_packet.size()) {
        const uint32_t index = m_costIndices[m_order[first]];
        m_packet.clear();
        for (size_t i = first; i < m_order.size() && m_packet.size() < kPacketSize; ++i) {
            if (m_costIndices[m_order[i]] != index)
                break;
            m_packet.push_back(requests[m_order[i]]);
        }
        const size_t size = m_packet.size();
        const size_t vertexCount = out.firstVertices.empty() ? 0 : size;
        const ShadeOutput packetOut{std::span(m_packetRadiance).first(size * (1 + m_components)),
                                    std::span(m_packetVertices).first(vertexCount)};
        const auto start = Clock::now();
        m_worker->shade(m_packet, packetOut, counters);
        const std::chrono::duration<double> seconds = Clock::now() - start;
        counters.shadeCosts[index].add(size, seconds.count());
        for (size_t i = 0; i < size; ++i)
            for (size_t component = 0; component <= m_components; ++component)
                out.radiance[component * requests.size() + m_order[first + i]] =
                    m_packetRadiance[component * size + i];
        for (size_t i = 0; i < vertexCount; ++i)
            out.firstVertices[m_order[first + i]] = m_packetVertices[i];
    }
}

} // namespace strobe
