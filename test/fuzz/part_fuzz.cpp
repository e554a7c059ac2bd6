// Parts and checkpoints. Arbitrary bytes are either a valid part or an Error; a valid part has a sum for each
// pixel, and adding it to itself is an Error, since the samples overlap.
#include "session/part_file.h"

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
        addPart(part, again, "fuzz.part"); // must throw
        std::abort();
    } catch (const Error&) {
    }
    return 0;
}
