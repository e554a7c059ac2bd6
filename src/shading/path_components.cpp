// The parts that radiance is split into: sums beside those of the whole, which they do not touch.
#include "shading/path_worker.h"

namespace strobe {

/// Adds light `light`'s contribution to the parts of a path.
void PathWorker::addComponent(std::vector<Rgb>& components, uint32_t path, int light, bool isDirect,
                              const Rgb& c) {
    Rgb* own = &components[size_t(path) * size_t(m_lightComponents.count())];
    if (m_lightComponents.byBounce) {
        own[isDirect ? 0 : 1] += c;
        own += 2;
    }
    if (m_lightComponents.groups > 0)
        own[m_scene.lights()[size_t(light)]->group] += c;
}

void PathWorker::startComponents(size_t paths) {
    const size_t count = paths * size_t(m_lightComponents.count());
    m_components.assign(count, Rgb(0));
    m_componentsViaBsdf.assign(count, Rgb(0));
}

/// At the end of a wave, as for Path::viaBsdf.
void PathWorker::joinComponents() {
    const size_t own = size_t(m_lightComponents.count());
    for (const uint32_t path : m_active)
        for (size_t i = path * own; i < (path + 1) * own; ++i)
            m_components[i] += std::exchange(m_componentsViaBsdf[i], Rgb(0));
}

/// Writes part by part.
void PathWorker::takeComponents(size_t paths, std::span<Rgb> components) const {
    const size_t own = size_t(m_lightComponents.count());
    for (size_t component = 0; component < own; ++component)
        for (size_t i = 0; i < paths; ++i)
            components[component * paths + i] = m_paths[i].component == LightComponent::Albedo
                                                    ? m_paths[i].radiance
                                                    : m_components[i * own + component];
}

} // namespace strobe
