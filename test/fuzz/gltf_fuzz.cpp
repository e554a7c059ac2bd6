// glTF files: whatever the bytes are, an Error or a scene.
#include "fuzz_file.h"
#include "gltf/import.h"

using namespace strobe;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        Messages quiet;
        const auto textures = std::make_shared<TextureCache>();
        gltf::Importer importer(gltf::open(fuzzFile(data, size, ".gltf"), {}), {}, *textures, quiet);
        const Shutter shutter{0, 1};
        importer.deformations(importer.motions(shutter), shutter);
    } catch (const Error&) {
    }
    return 0;
}
