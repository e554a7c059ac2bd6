#include "core/image/image_library.h"

#include "core/util/error.h"

#include <dlfcn.h>
#include <filesystem>

namespace strobe {
namespace {

/// The file lies beside the executable, or where it is installed as seen from there. (Not left to dlopen and
/// a run path: GCC's sanitizers call it in the name of their own library.)
void* openBeside(const std::filesystem::path& executable) {
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
    void* file = openBeside(std::filesystem::read_symlink("/proc/self/exe", failed));
    void* function = file ? dlsym(file, kImageLibrarySymbol) : nullptr;
    if (!function) {
        const char* reason = dlerror();
        throw Error(std::string("strobe's library of images, libstrobe_images.so, cannot be loaded: ") +
                    (reason ? reason : "it is not beside the program"));
    }
    return *reinterpret_cast<ImageLibraryFunction*>(function)();
}

} // namespace

const ImageLibrary& imageLibrary() {
    // One for the process, as what it loads is.
    static const ImageLibrary& library = load();
    return library;
}

} // namespace strobe
