#include "materials/merl_brdf.h"

#include <fstream>

namespace strobe {

MerlBrdf::MerlBrdf(const std::filesystem::path& path, const Location& where) {
    const auto fail = [&](const std::string& reason) {
        return Error(where, "MERL file " + path.string() + ": " + reason);
    };
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw fail("cannot be read");
    int32_t header[3] = {};
    if (!file.read(reinterpret_cast<char*>(header), sizeof(header)))
        throw fail("the header is incomplete");
    uint64_t cells = 1;
    for (int k = 0; k < 3; ++k) {
        if (header[k] < 1 || header[k] > 4096)
            throw fail("the header gives a resolution of " + std::to_string(header[k]) +
                       " (must be 1 to 4096)");
        m_size[size_t(k)] = header[k];
        cells *= uint64_t(header[k]);
    }
    std::error_code ignored;
    const uint64_t expected = sizeof(header) + 3 * cells * sizeof(double);
    const uint64_t size = std::filesystem::file_size(path, ignored);
    if (size != expected)
        throw fail("it has " + std::to_string(size) + " bytes instead of the " + std::to_string(expected) +
                   " that its header implies");
    m_values.resize(3 * cells);
    std::vector<double> plane(cells);
    const double scales[3] = {1 / 1500., 1.15 / 1500., 1.66 / 1500.};
    for (size_t c = 0; c < 3; ++c) {
        if (!file.read(reinterpret_cast<char*>(plane.data()), std::streamsize(cells * sizeof(double))))
            throw fail("cannot be read");
        for (size_t i = 0; i < cells; ++i)
            m_values[3 * i + c] = float(std::max(plane[i] * scales[c], 0.));
    }
}

Rgb MerlBrdf::eval(const V3f& wo, const V3f& wi) const {
    V3f wh = wo + wi, w = wi;
    const float l = length(wh);
    if (!(l > 0))
        return Rgb(0);
    wh *= (wh.z < 0 ? -1 : 1) / l;
    if (wo.z + wi.z < 0)
        w = -wi;
    // The frame of the difference angles: polar axis wh, x axis in the plane of wh and the normal.
    const float sinH = std::sqrt(wh.x * wh.x + wh.y * wh.y);
    const float cosPhi = sinH > 0 ? wh.x / sinH : 1.f, sinPhi = sinH > 0 ? wh.y / sinH : 0.f;
    const V3f x(cosPhi * wh.z, sinPhi * wh.z, -sinH), y(-sinPhi, cosPhi, 0);
    const float thetaH = std::acos(std::min(wh.z, 1.f));
    const float thetaD = std::acos(std::clamp(dot(w, wh), -1.f, 1.f));
    float phiD = std::atan2(dot(w, y), dot(w, x));
    if (phiD < 0) // reciprocity: exchanging wo and wi changes φd by 180°
        phiD += kPi;
    const auto cell = [](float fraction, int n) { return std::clamp(int(fraction * n), 0, n - 1); };
    const int h = cell(std::sqrt(thetaH / (kPi / 2)), m_size[0]);
    const int d = cell(thetaD / (kPi / 2), m_size[1]);
    const int p = cell(phiD / kPi, m_size[2]);
    const float* value = &m_values[3 * (size_t(p) + size_t(m_size[2]) * (size_t(d) + size_t(m_size[1]) * h))];
    return {value[0], value[1], value[2]};
}

} // namespace strobe
