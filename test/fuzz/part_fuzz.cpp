// Parts and checkpoints: any bytes are one or an Error. A damaged one is not to be taken for a good one: what
// is read has all its sums, and overlaps itself.
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
        addPart(part, again, "fuzz.part"); // overlaps
        std::abort();
    } catch (const Error&) {
    }
    return 0;
}
