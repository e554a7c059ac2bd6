// Fuzzes the readers of measured BRDFs, text and MERL: any bytes give a BRDF or an Error.
#include "core/util/error.h"
#include "fuzz_file.h"
#include "materials/irregular_brdf.h"
#include "materials/merl_brdf.h"

using namespace strobe;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::filesystem::path path = fuzzFile(data, size, ".brdf");
    const V3f up(0, 0, 1), low(0.8f, 0, 0.6f);
    try {
        IrregularBrdf(readIrregularBrdf(path, {})).eval(IrregularBrdf::keyOf(up, low));
    } catch (const Error&) {
    }
    try {
        MerlBrdf(path, {}).eval(up, low);
    } catch (const Error&) {
    }
    return 0;
}
