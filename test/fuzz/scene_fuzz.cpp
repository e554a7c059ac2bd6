// The scene language: any bytes give a description or a located Error.
#include "scene/parser.h"

#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    strobe::Messages quiet;
    try {
        strobe::parseText(std::string(reinterpret_cast<const char*>(data), size), "fuzz.scene",
                          {"supersample"}, quiet);
    } catch (const strobe::Error& e) {
        strobe::formatDiagnostic(e.location, "error", e.what());
    }
    return 0;
}
