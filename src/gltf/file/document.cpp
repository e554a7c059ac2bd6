#include "gltf/file/document.h"

#include "gltf/file/data_check.h"
#include "gltf/file/json_check.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>

namespace strobe::gltf {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<unsigned char>;

/// tinygltf and the header of .glb files count bytes in 32 bits.
constexpr uint64_t kMaxBytes = 0xfffffff0;
constexpr uint32_t kMagic = 0x46546c67;
constexpr uint32_t kJsonChunk = 0x4e4f534a;
constexpr uint32_t kBinaryChunk = 0x004e4942;

/// Reads a file; returns false and sets `reason` if it fails.
bool readWhole(const fs::path& path, Bytes& out, std::string& reason) {
    std::error_code error;
    const uint64_t size = fs::is_regular_file(path, error) ? fs::file_size(path, error) : 0;
    std::ifstream file(path, std::ios::binary);
    if (error || !file || !fs::is_regular_file(path, error)) {
        reason = "the file cannot be read";
        return false;
    }
    if (size > kMaxBytes) {
        reason = "the file is larger than 4 GiB";
        return false;
    }
    out.resize(size);
    if (!file.read(reinterpret_cast<char*>(out.data()), std::streamsize(size))) {
        reason = "the file cannot be read";
        return false;
    }
    return true;
}

uint32_t word(const Bytes& bytes, size_t offset) {
    return uint32_t(bytes[offset]) | uint32_t(bytes[offset + 1]) << 8 | uint32_t(bytes[offset + 2]) << 16 |
           uint32_t(bytes[offset + 3]) << 24;
}

bool isBinary(const Bytes& bytes) { return bytes.size() >= 4 && word(bytes, 0) == kMagic; }

/// Returns the JSON of a file, and sets `chunk` to the size of the binary chunk of a .glb. The chunks are
/// checked, since tinygltf reads beyond the end if the length of the last one is slightly too large.
std::string_view jsonOf(const Bytes& bytes, const JsonFail& fail, std::optional<uint64_t>& chunk,
                        Deviations& deviations) {
    const auto text = [&](size_t offset, size_t length) {
        return std::string_view(reinterpret_cast<const char*>(bytes.data()) + offset, length);
    };
    if (!isBinary(bytes))
        return text(0, bytes.size());
    if (bytes.size() < 20)
        fail("", "the file is truncated within its header");
    if (const uint32_t version = word(bytes, 4); version != 2)
        fail("", "version " + std::to_string(version) + " of .glb is not supported, only 2");
    const uint64_t length = word(bytes, 8);
    if (length > bytes.size())
        fail("", "the file is truncated: it has " + std::to_string(bytes.size()) + " of " +
                     std::to_string(length) + " bytes");
    std::string_view json;
    for (uint64_t offset = 12; offset < length;) {
        if (length - offset < 8)
            fail("", "the file is truncated within the header of a chunk");
        const uint64_t size = word(bytes, offset);
        const uint32_t type = word(bytes, offset + 4);
        if (size > length - offset - 8)
            fail("", "a chunk of " + std::to_string(size) + " bytes exceeds the file");
        if (offset == 12 && type != kJsonChunk)
            fail("", "the first chunk is not JSON");
        if (type == kJsonChunk && offset == 12)
            json = text(offset + 8, size);
        else if (offset == 20 + json.size() && type != kBinaryChunk)
            fail("", "the second chunk is not the binary buffer");
        else if (offset == 20 + json.size())
            chunk = size;
        else if (type == kJsonChunk || type == kBinaryChunk)
            deviations.emplace_back("", "the chunk at byte " + std::to_string(offset) + " is ignored");
        offset += 8 + size;
    }
    return json;
}

/// Replaces zeros at the end of the JSON of a .glb, with which some exporters pad it. Returns whether there
/// were any.
bool blankZeros(Bytes& bytes, std::string_view json) {
    const auto* begin = reinterpret_cast<const unsigned char*>(json.data());
    size_t end = size_t(begin - bytes.data()) + json.size();
    const size_t last = end;
    for (; !json.empty() && end > 20 && bytes[end - 1] == 0; --end)
        bytes[end - 1] = ' ';
    return end < last;
}

/// Replaces the JSON of a file.
void replaceJson(Bytes& bytes, std::string_view json, std::string text) {
    if (!isBinary(bytes)) {
        bytes.assign(text.begin(), text.end());
        return;
    }
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const auto begin = bytes.begin() + (reinterpret_cast<const unsigned char*>(json.data()) - bytes.data());
    Bytes rest(begin + ptrdiff_t(json.size()), bytes.end());
    bytes.erase(begin, bytes.end());
    bytes.insert(bytes.end(), text.begin(), text.end());
    bytes.insert(bytes.end(), rest.begin(), rest.end());
    for (int k = 0; k < 4; ++k) {
        bytes[8 + size_t(k)] = static_cast<unsigned char>(bytes.size() >> (8 * k));
        bytes[12 + size_t(k)] = static_cast<unsigned char>(text.size() >> (8 * k));
    }
}

/// The files that tinygltf may read: the buffers of the JSON.
struct AllowedFiles {
    struct File {
        fs::path requested; ///< name in the folder of the glTF file
        fs::path admitted;  ///< path to open
        uint64_t bytes;     ///< that the JSON needs
    };
    std::vector<File> files;

    /// Returns null if the file is not allowed.
    const File* find(const std::string& path) const {
        for (const File& file : files)
            if (path == file.requested)
                return &file;
        return nullptr;
    }
};

tinygltf::FsCallbacks callbacks(AllowedFiles& files) {
    return {[](const std::string& path, void* user) {
                std::error_code ignored;
                return static_cast<AllowedFiles*>(user)->find(path) && fs::exists(path, ignored);
            },
            [](const std::string& path, void*) { return path; },
            [](Bytes* out, std::string* reason, const std::string& path, void* user) {
                const AllowedFiles::File* file = static_cast<AllowedFiles*>(user)->find(path);
                if (!file || !readWhole(file->admitted, *out, *reason))
                    return false;
                if (out->size() > file->bytes) // tinygltf reports longer files as mistakes
                    out->resize(file->bytes);
                return true;
            },
            [](std::string*, const std::string&, const Bytes&, void*) { return false; }, &files};
}

/// Stores the bytes of data URIs. Images in buffer views are read later, when bounds are checked.
bool keepImage(tinygltf::Image* image, const int, std::string*, std::string*, int, int,
               const unsigned char* bytes, int size, void*) {
    if (image->bufferView < 0 && size > 0)
        image->image.assign(bytes, bytes + size);
    image->as_is = true;
    return true;
}

fs::path folderOf(const fs::path& file) {
    return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// Removes all occurrences of `part`. Returns their number.
int removeAll(std::string& text, const std::string& part) {
    int count = 0;
    for (size_t begin = text.find(part); begin != std::string::npos; begin = text.find(part), ++count)
        text.erase(begin, part.size());
    return count;
}

std::string onOneLine(std::string text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())))
        text.pop_back();
    for (size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n'))
        text.replace(end, 1, "; ");
    return text.size() > 300 ? text.substr(0, 300) + " …" : text;
}

} // namespace

fs::path Document::resolve(const std::string& uri) const {
    return admitted(folderOf(m_path) / decodeUri(uri));
}

std::vector<fs::path> Document::files() const {
    std::vector<fs::path> files{m_path};
    const auto add = [&](const std::string& uri) {
        if (!uri.empty() && uri.compare(0, 5, "data:") != 0)
            files.push_back(resolve(uri));
    };
    for (const auto& buffer : m_model.buffers)
        add(buffer.uri);
    for (const auto& image : m_model.images)
        add(image.uri);
    return files;
}

std::string Document::text(const std::string& jsonPath, const std::string& message) const {
    return m_path.string() + ": " + (jsonPath.empty() ? "" : jsonPath + ": ") + message;
}

void Document::fail(const std::string& jsonPath, const std::string& message) const {
    throw Error(m_where, text(jsonPath, message));
}

void Document::failIndex(int index, size_t count, const char* noun, const std::string& jsonPath) const {
    fail(jsonPath, std::string("there is no ") + noun + " " + std::to_string(index) + "; the file has " +
                       std::to_string(count));
}

void Document::warnOnce(Diagnostics& diagnostics, const std::string& key, const std::string& jsonPath,
                        const std::string& message) const {
    diagnostics.warnOnce(m_path.string() + " " + key, m_where, text(jsonPath, message));
}

void Document::tolerate(Diagnostics& diagnostics, const std::string& key, const std::string& jsonPath,
                        const std::string& message) const {
    if (diagnostics.isStrict())
        fail(jsonPath, message);
    warnOnce(diagnostics, key, jsonPath, message);
}

void Document::tolerateReplaced(Diagnostics& diagnostics) const {
    for (const auto& [jsonPath, message] : m_replaced)
        tolerate(diagnostics, jsonPath + message, jsonPath, message);
}

void Document::tolerateAll(Diagnostics& diagnostics) const {
    constexpr size_t kMost = 8; // warnings; there may be one for each vertex attribute
    Deviations all = m_tolerated;
    const Deviations ofData = findDataDeviations(*this);
    all.insert(all.end(), ofData.begin(), ofData.end());
    for (size_t i = 0; i < all.size() && i < kMost; ++i) {
        const auto& [jsonPath, message] = all[i];
        tolerate(diagnostics, jsonPath + message, jsonPath, message);
    }
    if (all.size() > kMost)
        warnOnce(diagnostics, "deviations", "",
                 std::to_string(all.size() - kMost) + " further deviations from glTF 2.0");
}

void Document::requireBuffer(size_t index) const {
    if (const auto missing = m_missingBuffers.find(index); missing != m_missingBuffers.end())
        fail(missing->second.first, missing->second.second);
}

Document::Document(const fs::path& path, const Location& where, std::shared_ptr<const ResourcePolicy> policy)
    : m_path(path), m_where(where), m_policy(std::move(policy)) {
    Bytes bytes;
    if (std::string reason; !readWhole(admitted(path), bytes, reason))
        fail("", reason);
    if (bytes.empty())
        fail("", "the file is empty");
    parse(std::move(bytes));
}

void Document::parse(Bytes bytes) {
    const JsonFail failHere = [&](const std::string& jsonPath, const std::string& message) {
        fail(jsonPath, message);
    };
    std::optional<uint64_t> chunk;
    const std::string_view json = jsonOf(bytes, failHere, chunk, m_tolerated);
    if (json.starts_with("\xef\xbb\xbf"))
        m_tolerated.emplace_back("", "the JSON begins with a byte order mark");
    if (isBinary(bytes) && blankZeros(bytes, json))
        m_tolerated.emplace_back("", "the JSON is padded with zeros instead of blanks");
    JsonFacts facts = checkJson(json, chunk, isBinary(bytes), failHere);
    m_ignored = std::move(facts.ignoredExtensions);
    for (const std::string& extension : facts.optionalRequired)
        m_tolerated.emplace_back("extensionsRequired",
                                 extension + " is not supported; the file is shown without it");
    m_tolerated.insert(m_tolerated.end(), facts.deviations.begin(), facts.deviations.end());
    m_replaced = std::move(facts.replaced);
    m_missingBuffers = std::move(facts.missingBuffers);
    if (!facts.replacement.empty())
        replaceJson(bytes, json, facts.replacement);
    load(bytes, facts.bufferFiles);
    for (const size_t index : facts.unbackedAccessors)
        m_model.accessors[index].bufferView = -1;
}

/// Loads the model by tinygltf, which may open no files but `bufferFiles`.
void Document::load(const Bytes& bytes, const std::map<std::string, uint64_t>& bufferFiles) {
    const fs::path folder = folderOf(m_path);
    AllowedFiles files;
    for (const auto& [name, neededBytes] : bufferFiles) {
        const fs::path file = admitted(folder / name);
        files.files.push_back({folder / name, file, neededBytes});
        std::error_code error;
        const uint64_t size = fs::is_regular_file(file, error) ? fs::file_size(file, error) : 0;
        if (error || !fs::is_regular_file(file, error))
            fail("buffers", "\"" + file.string() + "\" cannot be read");
        if (size < neededBytes)
            fail("buffers", "\"" + file.string() + "\" has " + std::to_string(size) + " of " +
                                std::to_string(neededBytes) + " bytes");
    }

    tinygltf::TinyGLTF reader;
    reader.SetFsCallbacks(callbacks(files));
    reader.SetImageLoader(keepImage, nullptr);
    std::string error;
    std::string ignoredWarning; // all warnings of tinygltf concern images, which are read elsewhere
    bool isRead = false;
    try {
        const auto size = static_cast<unsigned>(bytes.size());
        const auto* text = reinterpret_cast<const char*>(bytes.data());
        isRead = isBinary(bytes) ? reader.LoadBinaryFromMemory(&m_model, &error, &ignoredWarning,
                                                               bytes.data(), size, folder.string())
                                 : reader.LoadASCIIFromString(&m_model, &error, &ignoredWarning, text, size,
                                                              folder.string());
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        error += e.what();
    }
    if (!isRead)
        fail("", error.empty() ? "tinygltf cannot read the file" : onOneLine(error));
    // tinygltf requires the inverse bind matrices of skins, which glTF does not.
    removeAll(error, "'inverseBindMatrices' property is missing in Skin.\n");
    if (removeAll(error,
                  "'node' property is missing.\n`node` field is missing in animation.channels.target\n") > 0)
        m_tolerated.emplace_back("animations", "channels without a node are ignored");
    if (const std::string message = onOneLine(error); !message.empty())
        fail("", message);
}

} // namespace strobe::gltf
