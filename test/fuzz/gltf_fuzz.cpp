// glTF files: whatever the bytes are, an Error or a scene.
#include "gltf/import.h"

#include <unistd.h>

#include <fstream>

using namespace strobe;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("strobe-fuzz-" + std::to_string(getpid()) + ".gltf");
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data), std::streamsize(size));
    try {
        Messages quiet;
        const auto textures = std::make_shared<TextureCache>();
        gltf::Importer importer(gltf::open(path, {}), {}, *textures, quiet);
        const Shutter shutter{0, 1};
        importer.deformations(importer.motions(shutter), shutter);
    } catch (const Error&) {
    }
    return 0;
}
