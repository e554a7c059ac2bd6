// Fuzzes the records of tiles of adaptive-cache, which part files contain: any bytes give sums or an Error,
// and sums can be merged and reconstructed.
#include "core/util/error.h"
#include "sharing/reconstruction.h"

using namespace strobe;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const PixelBounds bounds{1, 1, 4, 3};
    Film film(4, 4, bounds);
    const SharedBytes bytes(std::string(reinterpret_cast<const char*>(data), size));
    film.records().set({{bounds, {0, 2}, bytes}, {bounds, {2, 4}, bytes}});
    try {
        mergeRecordsOfSamePixels(film.records());
        RecordedLight light(film);
        const LightParts parts = light.parts;
        LightSharing sharing(std::move(light));
        for (const LightPart part : kAllParts)
            if (parts.has(part))
                sharing.share(part);
    } catch (const Error&) {
    }
    return 0;
}
