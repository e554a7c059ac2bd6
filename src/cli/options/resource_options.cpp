#include "cli/options/resource_options.h"

#include "cli/options/option_validators.h"

#include <sys/resource.h>

namespace strobe {

void addResourceOptions(CLI::App& app, RenderOptions& options) {
    constexpr uint64_t kMinMemory = 128 << 20; // libraries alone take half of it
    app.option_defaults()->group("Limits and invalid samples");
    app.add_option("--sandbox", options.resources.roots,
                   "folder or file that scenes may read, and no others; may be repeated")
        ->type_name("DIR")
        ->allow_extra_args(false);
    app.add_option("--max-memory", options.resources.maxMemory,
                   "memory limit, e.g. 4G or 800M; at least 128M")
        ->type_name("SIZE")
        ->transform(byteSize(kMinMemory));
    app.add_option(
           "--texture-mb", options.build.textureMegabytes,
           "memory for the texels of images, in MiB; default: half of --max-memory or of the machine's. "
           "Larger textures are moved to temporary files. Does not change the image")
        ->type_name("N")
        ->transform(integerBetween(1, 1 << 20));
    app.add_flag(
        "--strict", options.strict,
        "exit with code 6 if a sample is NaN, infinite or too large; refuse glTF files that do not conform");
    app.add_option("--clamp", options.clamp,
                   "scale down samples of which a channel is above X; biases the image")
        ->type_name("X")
        ->transform(numberAboveZero<float>());
}

void limitMemory(const ResourcePolicy::Settings& resources) {
    if (resources.maxMemory == 0)
        return;
    rlimit limit{};
    if (getrlimit(RLIMIT_DATA, &limit) == 0 && limit.rlim_cur > resources.maxMemory) {
        limit.rlim_cur = resources.maxMemory;
        setrlimit(RLIMIT_DATA, &limit);
    }
}

} // namespace strobe
