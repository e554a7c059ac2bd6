#include "core/image/exr_file.h"

#include "core/util/atomic_file.h"

#include <IlmThreadPool.h>
#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <ImfTiledOutputPart.h>

#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <deque>
#include <mutex>
#include <set>
#include <thread>

namespace strobe {

namespace {

constexpr std::array<const char*, 10> kCompressions = {"none",  "rle", "zips", "zip",  "piz",
                                                       "pxr24", "b44", "b44a", "dwaa", "dwab"};

bool isDwa(ExrSettings::Compression c) { return c == ExrSettings::Dwaa || c == ExrSettings::Dwab; }

/// Returns whether the compression may change 32-bit floats. (B44 changes only half floats.)
bool changesFloats(ExrSettings::Compression c) { return c == ExrSettings::Pxr24 || isDwa(c); }

[[noreturn]] void failWord(const std::string& word) {
    std::string known = "half, float";
    for (const char* name : kCompressions)
        known += std::string(", ") + name;
    throw Error("unknown EXR setting \"" + word + "\" (known: " + known +
                    "; dwaa:LEVEL, dwab:LEVEL; scanlines, tiles, tiles:EDGE; single, parts)",
                ErrorKind::Usage);
}

/// Returns the number after the colon of `word`; `fallback` if there is no colon. Throws Error unless the
/// number lies in [min, max].
template <class T>
T parseValue(const std::string& word, T fallback, T min, T max) {
    const size_t colon = word.find(':');
    if (colon == std::string::npos)
        return fallback;
    T value{};
    const char* end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data() + colon + 1, end, value);
    if (error != std::errc() || stop != end || !(value >= min && value <= max))
        failWord(word);
    return value;
}

void applyWord(const std::string& word, ExrSettings& settings) {
    const std::string name = word.substr(0, word.find(':'));
    const bool hasNoValue = name == word;
    const auto compression = std::find(kCompressions.begin(), kCompressions.end(), name);
    if (compression != kCompressions.end()) {
        settings.compression = ExrSettings::Compression(compression - kCompressions.begin());
        if (!hasNoValue && !isDwa(settings.compression))
            failWord(word);
        settings.dwaLevel = parseValue(word, ExrSettings{}.dwaLevel, 0.f, 1e5f);
    } else if (name == "tiles") {
        settings.tileSize = parseValue(word, 64, 1, 1 << 14);
    } else if (hasNoValue && (name == "half" || name == "float")) {
        settings.half = name == "half";
    } else if (hasNoValue && name == "scanlines") {
        settings.tileSize = 0;
    } else if (hasNoValue && (name == "single" || name == "parts")) {
        settings.isMultiPart = name == "parts";
    } else {
        failWord(word);
    }
}

[[noreturn]] void failWrite(const std::filesystem::path& path, const std::string& reason,
                            ErrorKind kind = ErrorKind::Output) {
    throw Error("cannot write " + path.string() + ": " + reason, kind);
}

void checkNames(const std::filesystem::path& path, const std::vector<ExrPart>& parts) {
    std::set<std::string> names, partNames;
    for (const ExrPart& part : parts) {
        if (part.name.empty() || !partNames.insert(part.name).second)
            failWrite(path, "part name \"" + part.name + "\" is empty or used twice");
        if (part.channels.empty())
            failWrite(path, "there are no channels in \"" + part.name + "\"");
        for (const ExrChannel& channel : part.channels)
            if (channel.name.empty() || !names.insert(channel.name).second)
                failWrite(path, "channel name \"" + channel.name + "\" is empty or used twice");
    }
}

/// Returns a single part with all channels and all metadata.
std::vector<ExrPart> mergeParts(const std::vector<ExrPart>& parts) {
    ExrPart all{"rgba", {}, {}};
    for (const ExrPart& part : parts) {
        all.channels.insert(all.channels.end(), part.channels.begin(), part.channels.end());
        all.metadata.insert(all.metadata.end(), part.metadata.begin(), part.metadata.end());
    }
    return {all};
}

bool hasExact(const ExrPart& part) {
    return std::any_of(part.channels.begin(), part.channels.end(),
                       [](const ExrChannel& c) { return c.exact; });
}

/// Returns whether the part has a channel of light, not only data.
bool isColor(const ExrPart& part) {
    return std::any_of(part.channels.begin(), part.channels.end(), [](const ExrChannel& c) {
        return !c.exact && std::holds_alternative<const float*>(c.data);
    });
}

/// The name of the working space defined by the Color Interop Forum.
constexpr const char* kInteropId = "lin_rec709_scene";

/// The pixels in the form of OpenEXR.
struct Pixels {
    Imf::FrameBuffer buffer;
    std::deque<std::vector<Imath::half>> halves; ///< converted channels, which `buffer` points to
};

Imf::PixelType pixelType(const ExrChannel& channel, const ExrSettings& settings) {
    if (std::holds_alternative<const uint32_t*>(channel.data))
        return Imf::UINT;
    return settings.half && !channel.exact ? Imf::HALF : Imf::FLOAT;
}

/// Converts to half floats. Clamps finite values to the range of half floats, since filters in other programs
/// cannot process infinity, and adds their number to `clamped`.
std::vector<Imath::half> toHalf(const float* data, size_t stride, size_t count, size_t& clamped) {
    std::vector<Imath::half> values(count);
    for (size_t i = 0; i < count; ++i) {
        const float value = data[i * stride];
        values[i] = Imath::half(value);
        if (values[i].isInfinity() && std::isfinite(value)) {
            values[i] = Imath::half(value > 0 ? float(HALF_MAX) : -float(HALF_MAX));
            ++clamped;
        }
    }
    return values;
}

void addSlice(Pixels& pixels, const ExrChannel& channel, Imf::PixelType type, const PixelBounds& pixelBounds,
              size_t& clamped) {
    const size_t width = size_t(pixelBounds.width());
    const char* base = std::visit([](auto* p) { return reinterpret_cast<const char*>(p); }, channel.data);
    size_t step = channel.stride * 4;
    if (type == Imf::HALF) {
        const float* data = std::get<const float*>(channel.data);
        pixels.halves.push_back(toHalf(data, channel.stride, width * size_t(pixelBounds.height()), clamped));
        base = reinterpret_cast<const char*>(pixels.halves.back().data());
        step = sizeof(Imath::half);
    }
    // OpenEXR addresses pixels by their coordinates, so the base is the address of pixel (0, 0).
    const ptrdiff_t origin = ptrdiff_t(step) * (pixelBounds.x0 + ptrdiff_t(width) * pixelBounds.y0);
    // OpenEXR does not write to the base of an output file.
    pixels.buffer.insert(channel.name,
                         Imf::Slice(type, const_cast<char*>(base) - origin, step, step * width));
}

void insertMetadata(Imf::Header& header, const Metadata& metadata) {
    for (const auto& [name, value] : metadata) {
        if (const int* i = std::get_if<int>(&value))
            header.insert(name, Imf::IntAttribute(*i));
        else if (const float* f = std::get_if<float>(&value))
            header.insert(name, Imf::FloatAttribute(*f));
        else if (const M44f* matrix = std::get_if<M44f>(&value))
            header.insert(name, Imf::M44fAttribute(*matrix));
        else
            header.insert(name, Imf::StringAttribute(std::get<std::string>(value)));
    }
}

Imf::Header makeHeader(const ExrPart& part, const ImageFrame& frame, const ExrSettings& settings) {
    Imf::Header header(Imath::Box2i({0, 0}, {frame.resolution.x - 1, frame.resolution.y - 1}),
                       Imath::Box2i({frame.dataWindow.x0, frame.dataWindow.y0},
                                    {frame.dataWindow.x1 - 1, frame.dataWindow.y1 - 1}));
    header.compression() = Imf::Compression(settings.compression);
    header.dwaCompressionLevel() = settings.dwaLevel;
    Imf::addChromaticities(header, Imf::Chromaticities()); // Rec. 709
    header.insert("oiio:ColorSpace", Imf::StringAttribute(isColor(part) ? settings.colorSpace : "data"));
    header.insert("colorInteropID", Imf::StringAttribute(isColor(part) ? kInteropId : "data"));
    insertMetadata(header, part.metadata);
    for (const ExrChannel& channel : part.channels)
        header.channels().insert(channel.name, Imf::Channel(pixelType(channel, settings)));
    header.setType(settings.tileSize > 0 ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
    if (settings.tileSize > 0)
        header.setTileDescription(
            Imf::TileDescription(unsigned(settings.tileSize), unsigned(settings.tileSize), Imf::ONE_LEVEL));
    if (settings.isMultiPart)
        header.setName(part.name);
    return header;
}

void writePixels(Imf::MultiPartOutputFile& file, int index, const Pixels& pixels, const ExrSettings& settings,
                 int height) {
    if (settings.tileSize > 0) {
        Imf::TiledOutputPart part(file, index);
        part.setFrameBuffer(pixels.buffer);
        part.writeTiles(0, part.numXTiles() - 1, 0, part.numYTiles() - 1);
    } else {
        Imf::OutputPart part(file, index);
        part.setFrameBuffer(pixels.buffer);
        part.writePixels(height);
    }
}

/// Sets the size of OpenEXR's global thread pool while a file is compressed; holds a lock, since the process
/// has only one pool.
class CompressionThreads {
  public:
    /// Uses `threads` threads (0: one per core), but at most one per 16 lines.
    CompressionThreads(int threads, int height) : m_lock(poolMutex()), m_previousCount(pool().numThreads()) {
        constexpr int kLinesPerTask = 16;
        const int requested = threads > 0 ? threads : int(std::thread::hardware_concurrency());
        const int count = std::min(requested, (height + kLinesPerTask - 1) / kLinesPerTask);
        try {
            pool().setNumThreads(count > 1 ? count : 0);
        } catch (const std::system_error&) { // the system refuses threads
            pool().setNumThreads(0);
        }
    }
    ~CompressionThreads() { pool().setNumThreads(m_previousCount); }
    CompressionThreads(const CompressionThreads&) = delete;
    CompressionThreads& operator=(const CompressionThreads&) = delete;

  private:
    static IlmThread::ThreadPool& pool() { return IlmThread::ThreadPool::globalThreadPool(); }
    static std::mutex& poolMutex() {
        static std::mutex mutex;
        return mutex;
    }
    const std::lock_guard<std::mutex> m_lock;
    const int m_previousCount;
};

std::string encode(const ImageFrame& frame, const std::vector<ExrPart>& parts, const Metadata& metadata,
                   const ExrSettings& settings, size_t& clamped) {
    std::vector<Imf::Header> headers;
    for (const ExrPart& part : parts) {
        headers.push_back(makeHeader(part, frame, settings));
        if (hasExact(part) && changesFloats(settings.compression))
            headers.back().compression() = Imf::ZIPS_COMPRESSION;
    }
    insertMetadata(headers.front(), metadata);
    Imf::StdOSStream stream;
    { // The destructor of the file completes it.
        Imf::MultiPartOutputFile file(stream, headers.data(), int(headers.size()));
        for (size_t i = 0; i < parts.size(); ++i) {
            Pixels pixels;
            for (const ExrChannel& channel : parts[i].channels)
                addSlice(pixels, channel, pixelType(channel, settings), frame.dataWindow, clamped);
            writePixels(file, int(i), pixels, settings, frame.dataWindow.height());
        }
    }
    return stream.str();
}

} // namespace

ExrSettings parseExrSettings(const std::string& words) {
    ExrSettings settings;
    for (size_t begin = 0; begin <= words.size();) {
        const size_t end = std::min(words.find(',', begin), words.size());
        applyWord(words.substr(begin, end - begin), settings);
        begin = end + 1;
    }
    return settings;
}

void checkExr(const std::filesystem::path& path, const std::vector<ExrPart>& parts,
              const ExrSettings& settings) {
    if (parts.empty())
        failWrite(path, "there are no channels");
    checkNames(path, parts);
    for (const ExrPart& part : parts)
        if (!settings.isMultiPart && changesFloats(settings.compression) && hasExact(part))
            failWrite(path,
                      std::string(kCompressions[settings.compression]) + " would change the data in \"" +
                          part.name + "\"; use zip, or add \"parts\" to compress that layer without loss",
                      ErrorKind::Usage);
}

size_t writeExr(const std::filesystem::path& path, const ImageFrame& frame, const std::vector<ExrPart>& parts,
                const Metadata& metadata, const ExrSettings& settings, int threads) {
    if (frame.dataWindow.width() < 1 || frame.dataWindow.height() < 1)
        failWrite(path, "the image is empty");
    checkExr(path, parts, settings);
    size_t clamped = 0;
    std::string bytes; // encoded in memory: OpenEXR's destructors ignore the errors of a full disk
    try {
        const CompressionThreads compression(threads, frame.dataWindow.height());
        bytes = encode(frame, settings.isMultiPart ? parts : mergeParts(parts), metadata, settings, clamped);
    } catch (const std::exception& e) {
        failWrite(path, e.what());
    }
    writeFileAtomically(path, bytes);
    return clamped;
}

} // namespace strobe
