#include "core/image/image_library.h"

#include "core/util/error.h"

#include <dlfcn.h>
#include <filesystem>

namespace strobe {
namespace {

/// Returns the files that contain this function, most specific first: libstrobe, or the program itself.
std::vector<std::filesystem::path> ownFiles() {
    std::vector<std::filesystem::path> files;
    std::error_code failed;
    Dl_info info{};
    if (dladdr(reinterpret_cast<const void*>(&ownFiles), &info) && info.dli_fname)
        files.push_back(std::filesystem::canonical(info.dli_fname, failed));
    files.push_back(std::filesystem::read_symlink("/proc/self/exe", failed));
    return files;
}

/// Loads the library from the folder of one of ownFiles, or from the folder strobe in it. Returns null on
/// failure. (Does not rely on the run path, since the sanitizers of GCC replace dlopen, which then uses the
/// run path of the sanitizer's library.)
void* loadFromOwnFolder() {
    for (const std::filesystem::path& own : ownFiles())
        for (const char* folder : {".", "strobe"}) {
            const std::filesystem::path file = own.parent_path() / folder / "libstrobe_images.so";
            std::error_code missing;
            if (!own.empty() && std::filesystem::exists(file, missing))
                return dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
        }
    return nullptr;
}

const ImageLibrary& load() {
    void* file = loadFromOwnFolder();
    void* function = file ? dlsym(file, kImageLibrarySymbol) : nullptr;
    if (!function) {
        const char* reason = dlerror();
        throw Error(std::string("cannot load the image library libstrobe_images.so: ") +
                    (reason ? reason : "it is neither beside libstrobe nor in its folder strobe"));
    }
    return *reinterpret_cast<ImageLibraryFunction*>(function)();
}

} // namespace

const ImageLibrary& imageLibrary() {
    static const ImageLibrary& library = load();
    return library;
}

} // namespace strobe
