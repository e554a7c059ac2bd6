// The parts that radiance is split into: sums beside those of the whole, which they do not touch.
#include "shading/path_worker.h"

namespace strobe {

/// Adds light `light`'s contribution to the parts of a path.
void PathWorker::addPart(std::vector<Rgb>& parts, uint32_t path, int light, bool isDirect, const Rgb& c) {
    Rgb* own = &parts[size_t(path) * size_t(m_split.parts())];
    if (m_split.byBounce) {
        own[isDirect ? 0 : 1] += c;
        own += 2;
    }
    if (m_split.groups > 0)
        own[m_scene.lights()[size_t(light)]->group] += c;
}

void PathWorker::startParts(size_t paths) {
    const size_t count = paths * size_t(m_split.parts());
    m_parts.assign(count, Rgb(0));
    m_partsViaBsdf.assign(count, Rgb(0));
}

/// At the end of a wave, as for Path::viaBsdf.
void PathWorker::joinParts() {
    const size_t own = size_t(m_split.parts());
    for (const uint32_t path : m_active)
        for (size_t i = path * own; i < (path + 1) * own; ++i)
            m_parts[i] += std::exchange(m_partsViaBsdf[i], Rgb(0));
}

/// Writes part by part.
void PathWorker::takeParts(size_t paths, std::span<Rgb> parts) const {
    const size_t own = size_t(m_split.parts());
    for (size_t part = 0; part < own; ++part)
        for (size_t i = 0; i < paths; ++i)
            parts[part * paths + i] =
                m_paths[i].part == LightPart::Albedo ? m_paths[i].radiance : m_parts[i * own + part];
}

} // namespace strobe
