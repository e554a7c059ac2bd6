#include "loader/build/plugin_library.h"

#include "core/util/file_bytes.h"
#include "loader/parser/content_hash.h"
#include "strobe/abi.h"

#include <dlfcn.h>
#include <elf.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <optional>

namespace strobe {

namespace {

using ElfHeader = Elf64_Ehdr;
using Segment = Elf64_Phdr;

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& reason) {
    throw Error("cannot load the plugin " + path.string() + ": " + reason, ErrorKind::Usage);
}

/// Returns the structure at an offset, if it lies within the bytes.
template <class T>
std::optional<T> readAt(std::string_view bytes, uint64_t offset) {
    if (offset > bytes.size() || bytes.size() - offset < sizeof(T))
        return std::nullopt;
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

/// The header of the program itself, which has the class, the byte order and the machine of libraries.
ElfHeader ownHeader() {
    ElfHeader header{};
    std::ifstream("/proc/self/exe", std::ios::binary).read(reinterpret_cast<char*>(&header), sizeof header);
    return header;
}

/// Throws if the file is not a whole shared library for this machine. The dynamic loader maps what the
/// segments name without asking whether the file has it.
void checkSegments(const std::filesystem::path& path, std::string_view bytes) {
    const std::optional<ElfHeader> header = readAt<ElfHeader>(bytes, 0);
    if (!header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0 || header->e_type != ET_DYN)
        fail(path, "it is not a shared library");
    const ElfHeader own = ownHeader();
    if (header->e_machine != own.e_machine || header->e_ident[EI_CLASS] != own.e_ident[EI_CLASS] ||
        header->e_ident[EI_DATA] != own.e_ident[EI_DATA])
        fail(path, "it is for another processor");
    bool isDynamic = false;
    for (uint64_t i = 0; i < header->e_phnum; ++i) {
        const auto segment = readAt<Segment>(bytes, header->e_phoff + i * header->e_phentsize);
        if (!segment ||
            (segment->p_type == PT_LOAD &&
             (segment->p_offset > bytes.size() || segment->p_filesz > bytes.size() - segment->p_offset)))
            fail(path, "it is truncated or damaged");
        isDynamic |= segment->p_type == PT_DYNAMIC;
    }
    if (!isDynamic)
        fail(path, "it is not a shared library");
    // Linkers write the table of sections last.
    const uint64_t sections = uint64_t{header->e_shnum} * header->e_shentsize;
    if (header->e_shoff > bytes.size() || sections > bytes.size() - header->e_shoff)
        fail(path, "it is truncated or damaged");
}

FileBytes bytesOf(const std::filesystem::path& path) {
    try {
        return readFileBytes(path);
    } catch (const std::runtime_error& e) {
        fail(path, e.what());
    }
}

/// Returns the ABI that STROBE_PLUGIN_LIBRARY wrote into a file; empty if there is none.
std::string abiIn(std::string_view bytes) {
    constexpr std::string_view kMarker = STROBE_ABI_MARKER;
    const size_t start = bytes.find(kMarker);
    if (start == std::string_view::npos)
        return {};
    constexpr size_t kMaxLength = 1024;
    const std::string_view rest = bytes.substr(start + kMarker.size(), kMaxLength);
    return std::string(rest.substr(0, rest.find('\0')));
}

std::vector<std::string> fieldsOf(const std::string& abi) {
    std::vector<std::string> fields;
    for (size_t first = 0; first < abi.size();) {
        const size_t end = std::min(abi.find(' ', first), abi.size());
        fields.push_back(abi.substr(first, end - first));
        first = end + 1;
    }
    return fields;
}

/// Throws if the file was made for another ABI. The message has the fields that differ.
void checkAbi(const std::filesystem::path& path, const std::string& abi) {
    if (abi == pluginAbi())
        return;
    if (abi.empty())
        fail(path, "it has no plugins of strobe (STROBE_PLUGIN_LIBRARY)");
    std::string differences;
    const std::vector<std::string> theirs = fieldsOf(abi), ours = fieldsOf(pluginAbi());
    for (size_t i = 0; i < std::max(theirs.size(), ours.size()); ++i) {
        const std::string a = i < theirs.size() ? theirs[i] : "-", b = i < ours.size() ? ours[i] : "-";
        if (a != b)
            differences += (differences.empty() ? "" : ", ") + a + " instead of " + b;
    }
    fail(path, "it was made for another build of strobe (" + differences +
                   "); rebuild it with the CMake package of this strobe");
}

/// An exception of a static initializer. It leaves the dynamic loader locked.
struct InitializerError : Error {
    using Error::Error;
};

/// Calls dlopen, which is declared not to throw. Exceptions of static initializers pass through it.
void* load(const std::filesystem::path& path) {
    void* (*volatile const open)(const char*, int) = dlopen;
    const auto thrown = [&](const std::string& what) {
        return InitializerError("cannot load the plugin " + path.string() +
                                    ": it throws when it is loaded: " + what,
                                ErrorKind::Usage);
    };
    try {
        return open(std::filesystem::absolute(path).c_str(), RTLD_NOW | RTLD_LOCAL);
    } catch (const std::exception& e) {
        throw thrown(e.what());
    } catch (...) {
        throw thrown("not a std::exception");
    }
}

using AddPlugins = void(PluginRows&);

AddPlugins& openLibrary(const std::filesystem::path& path) {
    void* const handle = load(path);
    if (!handle)
        fail(path, dlerror());
    void* const function = dlsym(handle, STROBE_ADD_PLUGINS_SYMBOL);
    if (!function)
        fail(path, std::string("it lacks the function ") + STROBE_ADD_PLUGINS_SYMBOL);
    return *reinterpret_cast<AddPlugins*>(function);
}

/// Returns the file that a name means.
std::filesystem::path findLibrary(const std::filesystem::path& name,
                                  const std::vector<std::filesystem::path>& folders) {
    std::error_code ignored;
    if (!name.has_parent_path() && !std::filesystem::exists(name, ignored))
        for (const auto& folder : folders)
            if (std::filesystem::exists(folder / name, ignored))
                return folder / name;
    return name;
}

std::vector<std::filesystem::path> librariesIn(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (auto entry = std::filesystem::directory_iterator(folder, error);
         !error && entry != std::filesystem::directory_iterator(); entry.increment(error))
        if (entry->path().extension() == ".so")
            files.push_back(entry->path());
    std::sort(files.begin(), files.end());
    return files;
}

} // namespace

std::vector<std::pair<std::string, uint64_t>> usedPlugins(const PluginLibraries& libraries,
                                                          const SceneDescription& description,
                                                          std::set<std::string> names) {
    const auto add = [&](const std::optional<Statement>& statement) {
        if (statement)
            names.insert(statement->name);
    };
    for (const auto& statement : {description.camera, description.sampler, description.filter,
                                  description.shading, description.integrator})
        add(statement);
    for (const TextureDecl& texture : description.textures)
        add(texture.texture);
    for (const MaterialDecl& material : description.materials)
        add(material.material);
    for (const AreaLightDecl& light : description.areaLights)
        add(light.light);
    for (const LightDecl& light : description.lights)
        add(light.light);
    for (const ShapeDecl& shape : description.world.shapes)
        add(shape.shape);
    for (const ObjectDecl& object : description.objects)
        for (const ShapeDecl& shape : object.shapes)
            add(shape.shape);
    std::vector<std::pair<std::string, uint64_t>> used;
    for (const PluginLibrary& library : libraries) {
        bool isUsed = false;
        library.rows.forEachKind(library.rows, [&](const char*, const auto& rows, const auto&) {
            for (const auto& row : rows)
                isUsed |= names.contains(row.name);
        });
        if (isUsed)
            used.emplace_back("plugin " + library.path.filename().string(), library.hash);
    }
    return used;
}

const char* pluginAbi() { return STROBE_ABI; }

PluginLibrary loadPluginLibrary(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error))
        fail(path, std::filesystem::exists(path, error) ? "it is not a file" : "there is no such file");
    const FileBytes bytes = bytesOf(path);
    checkSegments(path, bytes.view());
    checkAbi(path, abiIn(bytes.view()));
    PluginLibrary library{path, textHash(bytes.view()), {}};
    try {
        openLibrary(path)(library.rows);
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        fail(path, std::string("its plugins cannot be added: ") + e.what());
    }
    return library;
}

PluginLibraries loadPluginLibraries(const std::vector<std::filesystem::path>& files,
                                    const std::vector<std::filesystem::path>& folders,
                                    Diagnostics& diagnostics) {
    PluginLibraries libraries;
    const auto isLoaded = [&](const std::filesystem::path& file) {
        std::error_code error;
        return std::any_of(libraries.begin(), libraries.end(), [&](const PluginLibrary& library) {
            return std::filesystem::equivalent(library.path, file, error);
        });
    };
    for (const auto& name : files)
        if (const auto file = findLibrary(name, folders); !isLoaded(file))
            libraries.push_back(loadPluginLibrary(file));
    for (const auto& folder : folders)
        for (const auto& file : librariesIn(folder)) {
            if (isLoaded(file))
                continue;
            try {
                libraries.push_back(loadPluginLibrary(file));
            } catch (const InitializerError&) {
                throw;
            } catch (const Error& e) {
                diagnostics.warn({}, e.what());
            }
        }
    return libraries;
}

} // namespace strobe
