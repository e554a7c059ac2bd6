// Fuzzes glTF import and scenes of glTF files: any bytes give a scene or an Error.
#include "fuzz_file.h"
#include "fuzz_scene.h"
#include "gltf/import.h"

using namespace strobe;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::filesystem::path& path = fuzzFile(data, size, ".gltf");
    Diagnostics quiet;
    try {
        const auto textures = std::make_shared<TextureCache>();
        gltf::Importer importer(gltf::open(path, {}), {}, *textures, quiet);
        const Shutter shutter{0, 1};
        importer.deformations(importer.motions(shutter), shutter);
        buildSmall(parseFiles({path}, {}, quiet, fuzzGuard()), quiet);
    } catch (const Error&) {
    }
    return 0;
}
