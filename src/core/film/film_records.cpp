#include "core/film/film_records.h"

namespace strobe {

namespace {

/// Calls work(iterator) for the records that lie within the tile.
template <class Map, class Work>
void forEachWithin(Map& map, const PixelBounds& tile, const Work& work) {
    for (int y = tile.y0; y < tile.y1; ++y) {
        auto it = map.lower_bound({y, tile.x0});
        while (it != map.end() && it->first < std::pair(y, tile.x1)) {
            const auto current = it++; // so that work may erase it
            if (current->second.pixels.x1 <= tile.x1 && current->second.pixels.y1 <= tile.y1)
                work(current);
        }
    }
}

} // namespace

FilmRecords::FilmRecords(const FilmRecords& other) { *this = other; }

FilmRecords& FilmRecords::operator=(const FilmRecords& other) {
    if (this != &other) {
        const std::scoped_lock lock(m_mutex, other.m_mutex);
        m_records = other.m_records;
        m_note = other.m_note;
    }
    return *this;
}

std::string FilmRecords::note() const {
    const std::lock_guard lock(m_mutex);
    return m_note;
}

void FilmRecords::setNote(std::string note) {
    const std::lock_guard lock(m_mutex);
    m_note = std::move(note);
}

void FilmRecords::insert(Map& map, FilmRecord record) {
    const std::pair key(record.pixels.y0, record.pixels.x0);
    map.emplace(key, std::move(record));
}

void FilmRecords::add(FilmRecord record) {
    const std::lock_guard lock(m_mutex);
    insert(m_records, std::move(record));
}

void FilmRecords::add(const FilmRecords& other) {
    const std::scoped_lock lock(m_mutex, other.m_mutex);
    m_records.insert(other.m_records.begin(), other.m_records.end());
    if (m_note.empty())
        m_note = other.m_note;
}

std::vector<FilmRecord> FilmRecords::within(const PixelBounds& tile) const {
    const std::lock_guard lock(m_mutex);
    std::vector<FilmRecord> records;
    forEachWithin(m_records, tile, [&](auto it) { records.push_back(it->second); });
    return records;
}

void FilmRecords::copyFrom(const FilmRecords& source, const PixelBounds& tile) {
    std::vector<FilmRecord> records = source.within(tile);
    remove(tile);
    setNote(source.note());
    for (FilmRecord& record : records)
        add(std::move(record));
}

void FilmRecords::remove(const PixelBounds& tile) {
    const std::lock_guard lock(m_mutex);
    forEachWithin(m_records, tile, [&](auto it) { m_records.erase(it); });
}

void FilmRecords::clear() {
    const std::lock_guard lock(m_mutex);
    m_records.clear();
}

void FilmRecords::set(std::vector<FilmRecord> records) {
    Map map;
    for (FilmRecord& record : records)
        insert(map, std::move(record));
    const std::lock_guard lock(m_mutex);
    m_records = std::move(map);
}

std::vector<FilmRecord> FilmRecords::all() const {
    const std::lock_guard lock(m_mutex);
    std::vector<FilmRecord> records;
    for (const auto& [key, record] : m_records)
        records.push_back(record);
    return records;
}

bool FilmRecords::isEmpty() const {
    const std::lock_guard lock(m_mutex);
    return m_records.empty();
}

} // namespace strobe
