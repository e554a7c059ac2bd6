// Fuzzes .part files and checkpoints: any bytes give a valid part or an Error. A valid part has the sums of
// all pixels of its boxes, and overlaps itself.
#include "core/util/error.h"
#include "session/files/part_file.h"

#include <cstdint>
#include <cstdlib>
#include <sstream>

using namespace strobe;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        PartReader part(
            std::make_unique<std::istringstream>(std::string(reinterpret_cast<const char*>(data), size)),
            "fuzz.part");
        size_t pixels = 0, covered = 0;
        part.read({[&](int, int, const PixelAccumulator&) { ++pixels; }, [](const FilmRecord&) {},
                   [](const FilmRecord&) {}});
        const CoveredPixels rows(part.header());
        for (int y = part.header().pixelBounds.y0; y < part.header().pixelBounds.y1; ++y)
            covered += rows.countOf(y);
        if (pixels != covered || !differenceOf(part.header(), part.header()).empty())
            std::abort();
    } catch (const Error&) {
    }
    return 0;
}
