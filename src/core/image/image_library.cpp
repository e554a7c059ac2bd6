#include "core/image/image_library.h"

#include "core/util/error.h"

#include <dlfcn.h>
#include <filesystem>

namespace strobe {
namespace {

/// Loads the library from the directory of the executable, or from the installation directory relative to it.
/// Returns null on failure. (Does not rely on the run path of the executable, since the sanitizers of GCC
/// replace dlopen, which then uses the run path of the sanitizer's library.)
void* loadRelativeTo(const std::filesystem::path& executable) {
    for (const char* folder : {".", STROBE_IMAGES_FOLDER}) {
        const std::filesystem::path file = executable.parent_path() / folder / "libstrobe_images.so";
        std::error_code missing;
        if (std::filesystem::exists(file, missing))
            return dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    }
    return nullptr;
}

const ImageLibrary& load() {
    std::error_code failed;
    void* file = loadRelativeTo(std::filesystem::read_symlink("/proc/self/exe", failed));
    void* function = file ? dlsym(file, kImageLibrarySymbol) : nullptr;
    if (!function) {
        const char* reason = dlerror();
        throw Error(std::string("cannot load the image library libstrobe_images.so: ") +
                    (reason ? reason : "it is not beside the executable"));
    }
    return *reinterpret_cast<ImageLibraryFunction*>(function)();
}

} // namespace

const ImageLibrary& imageLibrary() {
    static const ImageLibrary& library = load();
    return library;
}

} // namespace strobe
