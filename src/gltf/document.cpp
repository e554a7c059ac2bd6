#include "gltf/document.h"

#include "gltf/json_check.h"

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

/// tinygltf counts bytes in 32 bits, and so does the header of .glb.
constexpr uint64_t kMaxBytes = 0xfffffff0;
constexpr uint32_t kMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinChunk = 0x004e4942;

bool readWhole(const fs::path& path, Bytes& out, std::string& why) {
    std::error_code error;
    const uint64_t size = fs::is_regular_file(path, error) ? fs::file_size(path, error) : 0;
    std::ifstream file(path, std::ios::binary);
    if (error || !file || !fs::is_regular_file(path, error)) {
        why = "the file cannot be read";
        return false;
    }
    if (size > kMaxBytes) {
        why = "the file is larger than 4 GiB";
        return false;
    }
    out.resize(size);
    if (!file.read(reinterpret_cast<char*>(out.data()), std::streamsize(size))) {
        why = "the file cannot be read";
        return false;
    }
    return true;
}

uint32_t word(const Bytes& bytes, size_t offset) {
    return uint32_t(bytes[offset]) | uint32_t(bytes[offset + 1]) << 8 | uint32_t(bytes[offset + 2]) << 16 |
           uint32_t(bytes[offset + 3]) << 24;
}

bool isBinary(const Bytes& bytes) { return bytes.size() >= 4 && word(bytes, 0) == kMagic; }

/// The JSON of a file; the chunks of a .glb are checked, since tinygltf reads a little beyond a last one
/// whose length is a little wrong.
std::string_view jsonOf(const Bytes& bytes, const JsonFail& fail, std::optional<uint64_t>& chunk) {
    const auto text = [&](size_t offset, size_t length) {
        return std::string_view(reinterpret_cast<const char*>(bytes.data()) + offset, length);
    };
    if (!isBinary(bytes))
        return text(0, bytes.size());
    if (bytes.size() < 20)
        fail("", "the file is cut off within its header");
    if (const uint32_t version = word(bytes, 4); version != 2)
        fail("", "this is a .glb of version " + std::to_string(version) + "; only 2 is supported");
    const uint64_t length = word(bytes, 8);
    if (length > bytes.size())
        fail("", "the file is cut off: it has " + std::to_string(bytes.size()) + " of " +
                     std::to_string(length) + " bytes");
    std::string_view json;
    for (uint64_t at = 12; at < length;) {
        if (length - at < 8)
            fail("", "the file is cut off within the header of a chunk");
        const uint64_t size = word(bytes, at);
        const uint32_t type = word(bytes, at + 4);
        if (size > length - at - 8)
            fail("", "a chunk of " + std::to_string(size) + " bytes reaches beyond the end of the file");
        if (at == 12 && type != kJsonChunk)
            fail("", "the first chunk is not JSON");
        if (type == kJsonChunk && at == 12)
            json = text(at + 8, size);
        else if (at == 20 + json.size() && type != kBinChunk)
            fail("", "the second chunk is not the binary buffer");
        else if (at == 20 + json.size())
            chunk = size;
        at += 8 + size;
    }
    return json;
}

/// What tinygltf may read: buffers that the check has found, in the folder of the file.
struct AllowedFiles {
    struct File {
        fs::path asked, place; ///< place: what to open
        uint64_t bytes;        ///< that are wanted
    };
    std::vector<File> files;

    /// Null where it is none of them.
    const File* find(const std::string& path) const {
        for (const File& file : files)
            if (path == file.asked)
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
            [](Bytes* out, std::string* why, const std::string& path, void* user) {
                const AllowedFiles::File* file = static_cast<AllowedFiles*>(user)->find(path);
                if (!file || !readWhole(file->place, *out, *why))
                    return false;
                if (out->size() > file->bytes) // which tinygltf would take for a mistake
                    out->resize(file->bytes);
                return true;
            },
            [](std::string*, const std::string&, const Bytes&, void*) { return false; }, &files};
}

/// Keeps the bytes of data URIs. Those of buffer views are left alone: their bounds are not checked yet.
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

std::string onOneLine(std::string text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())))
        text.pop_back();
    for (size_t at; (at = text.find('\n')) != std::string::npos;)
        text.replace(at, 1, "; ");
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

std::string Document::text(const std::string& place, const std::string& message) const {
    return m_path.string() + ": " + (place.empty() ? "" : place + ": ") + message;
}

void Document::fail(const std::string& place, const std::string& message) const {
    throw Error(m_where, text(place, message));
}

void Document::failIndex(int index, size_t count, const char* noun, const std::string& place) const {
    fail(place, std::string("there is no ") + noun + " " + std::to_string(index) + ": the file has " +
                    std::to_string(count));
}

void Document::warnOnce(Diagnostics& messages, const std::string& key, const std::string& place,
                        const std::string& message) const {
    messages.warnOnce(m_path.string() + " " + key, m_where, text(place, message));
}

Document::Document(const fs::path& path, const Location& where, std::shared_ptr<const ResourcePolicy> guard)
    : m_path(path), m_where(where), m_guard(std::move(guard)) {
    Bytes bytes;
    if (std::string why; !readWhole(admitted(path), bytes, why))
        fail("", why);
    if (bytes.empty())
        fail("", "the file is empty");
    parse(bytes);
}

void Document::parse(const Bytes& bytes) {
    const JsonFail failHere = [&](const std::string& place, const std::string& message) {
        fail(place, message);
    };
    std::optional<uint64_t> chunk;
    const std::string_view json = jsonOf(bytes, failHere, chunk);
    JsonFacts facts = checkJson(json, chunk, failHere);
    m_ignored = std::move(facts.ignoredExtensions);
    const fs::path folder = folderOf(m_path);
    AllowedFiles files;
    for (const auto& [name, wanted] : facts.bufferFiles) {
        const fs::path file = admitted(folder / name);
        files.files.push_back({folder / name, file, wanted});
        std::error_code error;
        const uint64_t there = fs::is_regular_file(file, error) ? fs::file_size(file, error) : 0;
        if (error || !fs::is_regular_file(file, error))
            fail("buffers", "\"" + file.string() + "\" cannot be read");
        if (there < wanted)
            fail("buffers", "\"" + file.string() + "\" has " + std::to_string(there) + " of " +
                                std::to_string(wanted) + " bytes");
    }

    tinygltf::TinyGLTF reader;
    reader.SetFsCallbacks(callbacks(files));
    reader.SetImageLoader(keepImage, nullptr);
    std::string error, warning; // of its warnings none concerns more than images, which are read elsewhere
    bool read = false;
    try {
        const auto size = static_cast<unsigned>(bytes.size());
        read = isBinary(bytes) ? reader.LoadBinaryFromMemory(&m_model, &error, &warning, bytes.data(), size,
                                                             folder.string())
                               : reader.LoadASCIIFromString(&m_model, &error, &warning,
                                                            reinterpret_cast<const char*>(bytes.data()), size,
                                                            folder.string());
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        error += e.what();
    }
    if (!read)
        fail("", error.empty() ? "tinygltf cannot read it" : onOneLine(error));
    // It wants inverse bind matrices of every skin, although they may be left out.
    const std::string needless = "'inverseBindMatrices' property is missing in Skin.\n";
    for (size_t at; (at = error.find(needless)) != std::string::npos;)
        error.erase(at, needless.size());
    if (const std::string what = onOneLine(error); !what.empty())
        fail("", what);
}

} // namespace strobe::gltf
