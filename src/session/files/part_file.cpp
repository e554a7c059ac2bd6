#include "session/files/part_file.h"

#include "core/util/atomic_file.h"
#include "core/util/compression.h"
#include "core/util/error.h"
#include "session/files/part_header.h"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>

namespace strobe {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFormat = "strobe part ";
constexpr std::string_view kFirstLine = "strobe part 5";
constexpr size_t kChecksumSize = 8; ///< hexadecimal digits

enum class BlockKind : uint32_t { Boxes, Sums, Record, Layers, End };

/// The beginning of a block, before its compressed bytes.
struct BlockHead {
    BlockKind kind;
    PixelBounds pixels;  ///< of Sums: the rows y0 … y1-1
    SampleSlice samples; ///< of Record and Layers
    uint32_t checksum;   ///< CRC-32 of this struct, with 0 for this member, and of the compressed bytes
    uint64_t size, compressedSize;
};
static_assert(sizeof(BlockHead) == 48);

uint32_t checksumOf(BlockHead head, std::string_view compressed) {
    head.checksum = 0;
    return crc32Of(compressed, crc32Of({reinterpret_cast<const char*>(&head), sizeof head}));
}

void appendBlock(BlockHead head, std::string_view bytes, std::string& out) {
    const std::string compressed = compressBytes(bytes);
    head.size = bytes.size();
    head.compressedSize = compressed.size();
    head.checksum = checksumOf(head, compressed);
    storeValue(head, out);
    out += compressed;
}

BlockHead headOf(BlockKind kind) { return {kind, {}, {}, 0, 0, 0}; }
BlockHead headOf(BlockKind kind, const FilmRecord& record) {
    return {kind, record.pixels, record.samples, 0, 0, 0};
}

/// Returns the end of the rows from y on whose sums make one block.
int endOfRows(const PartHeader& part, const CoveredPixels& pixels, int y) {
    constexpr size_t kMaxPixels = 1 << 14; // about 1 MB
    size_t count = 0;
    int end = y;
    do
        count += pixels.countOf(end++);
    while (end < part.pixelBounds.y1 && count + pixels.countOf(end) <= kMaxPixels);
    return end;
}

} // namespace

PartWriter::PartWriter(const PartHeader& part) : m_part(part), m_pixels(part) {
    const std::string json = partHeaderToJson(part);
    m_bytes = fmt::format("{}\n{:08x} {}\n", kFirstLine, crc32Of(json), json);
    appendBlock(headOf(BlockKind::Boxes), toBytePlanes(boxesToBytes(part.boxes), kBoxBytes), m_bytes);
}

void PartWriter::addSums(const std::vector<PixelAccumulator>& sums) {
    const PixelBounds& bounds = m_part.pixelBounds;
    for (int first = bounds.y0; first < bounds.y1;) {
        const int end = endOfRows(m_part, m_pixels, first);
        std::string bytes;
        for (int y = first; y < end; ++y)
            m_pixels.forRow(y, [&](int x0, int x1) {
                for (int x = x0; x < x1; ++x)
                    storeSum(sums[size_t(y - bounds.y0) * size_t(bounds.width()) + size_t(x - bounds.x0)],
                             bytes);
            });
        BlockHead head = headOf(BlockKind::Sums);
        head.pixels = {bounds.x0, first, bounds.x1, end};
        appendBlock(head, toBytePlanes(bytes, PixelAccumulator::kBytes), m_bytes);
        first = end;
    }
}

void PartWriter::addRecord(const FilmRecord& record) {
    appendBlock(headOf(BlockKind::Record, record), record.bytes.view(), m_bytes);
}

void PartWriter::addLayers(const FilmRecord& record) {
    appendBlock(headOf(BlockKind::Layers, record), record.bytes.view(), m_bytes);
}

std::string PartWriter::finish() {
    appendBlock(headOf(BlockKind::End), {}, m_bytes);
    return std::move(m_bytes);
}

void PartWriter::write(const fs::path& file) { writeFileAtomically(file, finish()); }

/// A block with its bytes decompressed.
struct PartReader::Block {
    BlockHead head;
    std::string bytes;

    FilmRecord record() const { return {head.pixels, head.samples, bytes}; }
};

PartReader::PartReader(const fs::path& file)
    : m_file(file), m_stream(std::make_unique<std::ifstream>(file, std::ios::binary)) {
    if (std::error_code ignored; fs::is_directory(file, ignored))
        fail("it is a folder");
    if (!*m_stream)
        fail(std::string("cannot read it: ") + std::strerror(errno));
    readHeader();
}

PartReader::PartReader(std::unique_ptr<std::istream> stream, const fs::path& file)
    : m_file(file), m_stream(std::move(stream)) {
    readHeader();
}

void PartReader::fail(const std::string& reason) const {
    throw Error(m_file.string() + ": " + reason, ErrorKind::Usage);
}

/// Reads up to a line end. A longer line, and one that the end of the file ends, is damaged.
std::string PartReader::readLine(size_t maxSize) {
    std::string line;
    for (int c; (c = m_stream->get()) != '\n'; line += char(c))
        if (c == std::istream::traits_type::eof() || line.size() == maxSize)
            fail("it is damaged");
    return line;
}

/// Reads chunk by chunk, so that a damaged size does not allocate more than the file has.
std::string PartReader::readBytes(uint64_t size) {
    constexpr uint64_t kChunk = 1 << 20;
    std::string bytes;
    while (bytes.size() < size) {
        const size_t first = bytes.size(), count = size_t(std::min(kChunk, size - first));
        bytes.resize(first + count);
        if (!m_stream->read(&bytes[first], std::streamsize(count)))
            fail("it is truncated");
    }
    return bytes;
}

void PartReader::readHeader() {
    std::string first(kFirstLine.size() + 1, '\0');
    m_stream->read(first.data(), std::streamsize(first.size()));
    if (!first.starts_with(kFormat))
        fail("it is not a part of a render");
    if (first != std::string(kFirstLine) + '\n')
        fail("it is a part of another version of strobe");
    constexpr size_t kMaxJson = 1 << 28;
    const std::string line = readLine(kMaxJson);
    uint32_t checksum = 0;
    const char* const end = line.data() + std::min(kChecksumSize, line.size());
    const auto [rest, error] = std::from_chars(line.data(), end, checksum, 16);
    const std::string_view json = std::string_view(line).substr(std::min(kChecksumSize + 1, line.size()));
    std::optional<PartHeader> header;
    if (error == std::errc() && rest == end && line.size() > kChecksumSize && line[kChecksumSize] == ' ' &&
        checksum == crc32Of(json))
        header = partHeaderFromJson(json);
    if (!header)
        fail("it is damaged");
    m_part = std::move(*header);
    const Block block = readBlock();
    auto boxes = boxesFromBytes(fromBytePlanes(block.bytes, kBoxBytes));
    if (block.head.kind != BlockKind::Boxes || !boxes)
        fail("it is damaged");
    m_part.boxes = std::move(*boxes);
    if (!isConsistent(m_part))
        fail("it is damaged");
}

PartReader::Block PartReader::readBlock() {
    const std::string headBytes = readBytes(sizeof(BlockHead));
    Block block{};
    std::memcpy(&block.head, headBytes.data(), sizeof block.head);
    const std::string compressed = readBytes(block.head.compressedSize);
    if (block.head.checksum != checksumOf(block.head, compressed) ||
        block.head.size > maxDecompressedSize(compressed.size()))
        fail("it is damaged");
    block.bytes.resize(block.head.size);
    if (!decompressBytes(compressed, block.bytes))
        fail("it is damaged");
    return block;
}

void PartReader::read(const PartSink& sink) {
    const CoveredPixels pixels(m_part);
    int y = m_part.pixelBounds.y0;
    for (;;) {
        const Block block = readBlock();
        const bool isRecord = block.head.kind == BlockKind::Record || block.head.kind == BlockKind::Layers;
        if (isRecord && !isWithin(m_part, block.head.pixels, block.head.samples))
            fail("it is damaged");
        if (block.head.kind == BlockKind::End)
            break;
        if (block.head.kind == BlockKind::Record)
            sink.record(block.record());
        else if (block.head.kind == BlockKind::Layers)
            sink.layers(block.record());
        else
            y = readSums(block, pixels, y, sink);
    }
    if (y != m_part.pixelBounds.y1)
        fail("it is damaged");
    if (m_stream->peek() != std::istream::traits_type::eof())
        fail("it is too long");
}

/// Reads the sums of the rows from y on. Returns the row after them.
int PartReader::readSums(const Block& block, const CoveredPixels& pixels, int y, const PartSink& sink) const {
    const PixelBounds& rows = block.head.pixels;
    size_t count = 0;
    if (block.head.kind != BlockKind::Sums || rows.y0 != y || rows.y1 <= y || rows.y1 > m_part.pixelBounds.y1)
        fail("it is damaged");
    for (; y < rows.y1; ++y)
        count += pixels.countOf(y);
    if (block.bytes.size() != count * PixelAccumulator::kBytes)
        fail("it is damaged");
    const std::string bytes = fromBytePlanes(block.bytes, PixelAccumulator::kBytes);
    const char* next = bytes.data();
    for (int row = rows.y0; row < rows.y1; ++row)
        pixels.forRow(row, [&](int x0, int x1) {
            for (int x = x0; x < x1; ++x, next += PixelAccumulator::kBytes) {
                PixelAccumulator sum;
                sum.load(next);
                sink.sum(x, row, sum);
            }
        });
    return y;
}

void addToFilm(PartReader& part, Film& film) {
    part.read({[&](int x, int y, const PixelAccumulator& sum) { film.add(x, y, sum); },
               [&](FilmRecord record) { film.records().add(std::move(record)); },
               [&](FilmRecord record) { film.layerRecords().add(std::move(record)); }});
    film.records().setNote(part.header().keyValue(PartHeader::kNote));
}

} // namespace strobe
