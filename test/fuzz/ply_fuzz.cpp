// Fuzzes the PLY reader: any bytes give a mesh or an Error.
#include "shapes/ply.h"

#include "core/util/error.h"

#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        strobe::parsePly({reinterpret_cast<const char*>(data), size}, "fuzz.ply", {});
    } catch (const strobe::Error&) {
    }
    return 0;
}
