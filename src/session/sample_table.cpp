#include "session/sample_table.h"

#include "core/util/atomic_file.h"

#include <fmt/format.h>

#include <algorithm>

namespace strobe {

void SampleTable::add(const SampleRecord& r) {
    const Hit& hit = r.sample.hit;
    std::string row = fmt::format("{},{},{},{:.9g},{:.9g},{:.9g},", r.x, r.y, r.number, r.sample.film.x,
                                  r.sample.film.y, r.sample.ray.time);
    if (hit)
        row += fmt::format("{},{},{},", hit.instance == kNone ? -1 : int64_t(hit.instance), hit.geometry,
                           hit.prim);
    else
        row += ",,,";
    row +=
        fmt::format("{},{},{:.9g},{:.9g},{:.9g}\n", r.sharingId, r.shades, r.value.x, r.value.y, r.value.z);
    const std::lock_guard lock(m_mutex);
    m_rows.emplace_back(Place(r.y, r.x, r.number), std::move(row));
}

void SampleTable::write(const std::filesystem::path& file) {
    std::sort(m_rows.begin(), m_rows.end());
    std::string text = "x,y,sample,film_x,film_y,time,instance,geometry,primitive,cell,shades,r,g,b\n";
    for (const auto& [place, row] : m_rows)
        text += row;
    writeFileAtomically(file, text);
}

} // namespace strobe
