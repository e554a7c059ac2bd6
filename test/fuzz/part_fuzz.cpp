// Fuzzes .part files and checkpoints: any bytes give a valid part or an Error. A valid part has the sums of
// all its pixels and overlaps itself.
#include "session/files/part_file.h"

#include <cstdint>
#include <cstdlib>

using namespace strobe;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        RenderPart part = parsePart({reinterpret_cast<const char*>(data), size}, "fuzz.part");
        if (part.sums.size() != size_t(part.pixelBounds.width()) * size_t(part.pixelBounds.height()))
            std::abort();
        missingSamples(part);
        const RenderPart again = part;
        addPart(part, again, "fuzz.part"); // must throw: the parts overlap
        std::abort();
    } catch (const Error&) {
    }
    return 0;
}
