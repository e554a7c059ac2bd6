#include "shading/path_batch.h"

#include <utility>

namespace strobe {

namespace {

/// Replaces the radiance at the vertices by parts of the radiance: see recordFirstVertices.
void finishFirstVertex(FirstVertex& vertex, const Rgb& radiance) {
    const Rgb before = vertex.direct, withDirect = vertex.hasIndirect ? vertex.indirect : radiance;
    vertex.direct = withDirect - before;
    vertex.indirect = radiance - withDirect;
}

} // namespace

void Path::start(const RequestSoA& requests, int i) {
    ray.o.x = requests.ray.o.x[i];
    ray.o.y = requests.ray.o.y[i];
    ray.o.z = requests.ray.o.z[i];
    ray.d.x = requests.ray.d.x[i];
    ray.d.y = requests.ray.d.y[i];
    ray.d.z = requests.ray.d.z[i];
    ray.time = requests.time[i];
    ray.tmin = 0;
    cone.width = requests.width[i];
    cone.spread = requests.spread[i];
    beta = Rgb(1);
    radiance = Rgb(0);
    lightRayRadiance = Rgb(0);
    domain = requests.domain[i];
    index = requests.index[i];
    total = requests.total[i];
    component = requests.component[i];
    isAbsorbed = false;
    crossings = 0;
    specularBounce = true;
    stage = recorded = PathStage::Camera;
    sampledLightIsDirect = true;
    sampledAllLights = false;
    bsdfPdf = 0;
    maxBsdfPdf = 0;
    previousP = V3f(0);
    previousNg = V3f(0);
    previousNs = V3f(0);
    previousTransmits = false;
}

void ComponentSums::add(uint32_t path, int light, bool isDirect, const Rgb& contribution) {
    Rgb* sums = &m_sums[size_t(path) * m_count];
    if (m_layout.byBounce) {
        sums[isDirect ? 0 : 1] += contribution;
        sums += 2;
    }
    if (m_layout.groups > 0)
        sums[m_scene.lights()[size_t(light)]->group] += contribution;
}

void ComponentSums::moveFrom(ComponentSums& from, uint32_t path) {
    for (size_t i = path * m_count; i < (path + 1) * m_count; ++i)
        m_sums[i] += std::exchange(from.m_sums[i], Rgb(0));
}

PathBatch::PathBatch(const Scene& scene, const LightComponents& layout)
    : components(scene, layout), lightRayComponents(scene, layout), m_scene(scene),
      m_hasManyMaterials(scene.materials().size() > 1) {}

namespace {

/// Returns the counter of a request that estimates light.
uint64_t& requestCounter(Counters& counters, bool isHit, LightComponent component) {
    if (!isHit)
        return counters.missed;
    return component == LightComponent::Direct ? counters.directShades : counters.shades;
}

} // namespace

void PathBatch::start(const ShadingRequests& requests, Counters& batchCounters) {
    counters = &batchCounters;
    if (paths.size() < requests.size()) {
        paths.resize(requests.size());
        m_materialBuckets.resize(requests.size());
    }
    components.reset(requests.size());
    lightRayComponents.reset(requests.size());
    albedo.clear();
    active.resize(requests.size());
    uint32_t path = 0, activeCount = 0;
    for (size_t c = 0; c < requests.chunks(); ++c) {
        const RequestSoA& chunk = requests.chunk(c);
        for (int i = 0; i < requests.chunkSize(c); ++i, ++path) {
            paths[path].start(chunk, i);
            setHit(path, chunk.hit.at(i)); // without a local copy: see Path::start
            const bool isHit = chunk.hit.geometry[i] != kNone;
            if (chunk.component[i] != LightComponent::Albedo)
                ++requestCounter(batchCounters, isHit, chunk.component[i]);
            else if (isHit) {
                albedo.push_back(path);
                continue;
            }
            active[activeCount++] = path;
        }
    }
    active.resize(activeCount);
}

void PathBatch::sortByMaterial(std::vector<uint32_t>& indices) {
    if (!m_hasManyMaterials)
        return;
    uint32_t positions[kMaterialBuckets + 1] = {};
    for (uint32_t i : indices)
        ++positions[m_materialBuckets[i] + 1];
    for (int b = 0; b < kMaterialBuckets; ++b)
        positions[b + 1] += positions[b];
    m_sorted.resize(indices.size());
    for (uint32_t i : indices)
        m_sorted[positions[m_materialBuckets[i]]++] = i;
    indices.swap(m_sorted);
}

void PathBatch::addLightRaySums() {
    for (uint32_t i : active) {
        paths[i].radiance += std::exchange(paths[i].lightRayRadiance, Rgb(0));
        components.moveFrom(lightRayComponents, i);
    }
}

void PathBatch::write(size_t requests, std::span<Rgb> radiance) {
    for (size_t i = 0; i < requests; ++i)
        radiance[i] = paths[i].radiance;
    for (size_t i = 0; i < firstVertices.size(); ++i)
        if (firstVertices[i].hit)
            finishFirstVertex(firstVertices[i], paths[i].radiance);
    for (size_t component = 0; component < components.count(); ++component) {
        const std::span<Rgb> values = radiance.subspan((component + 1) * requests);
        for (size_t i = 0; i < requests; ++i)
            values[i] = paths[i].component == LightComponent::Albedo ? paths[i].radiance
                                                                     : components.at(i, component);
    }
}

} // namespace strobe
