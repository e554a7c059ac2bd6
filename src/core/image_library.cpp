#include "core/image_library.h"

#include "core/error.h"

#include <dlfcn.h>

namespace strobe {

const ImageLibrary& imageLibrary() {
    // One for the process, as what it loads is.
    static const ImageLibrary& library = []() -> const ImageLibrary& {
        void* file = dlopen("libstrobe_images.so", RTLD_NOW | RTLD_LOCAL);
        void* function = file ? dlsym(file, kImageLibrarySymbol) : nullptr;
        if (!function)
            throw Error(std::string("strobe's library of images cannot be loaded: ") + dlerror());
        return *reinterpret_cast<ImageLibraryFunction*>(function)();
    }();
    return library;
}

} // namespace strobe
