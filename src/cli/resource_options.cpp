#include "cli/resource_options.h"

#include "cli/option_validators.h"

#include <sys/resource.h>

namespace strobe {

void addResourceOptions(CLI::App& app, RenderOptions& options) {
    constexpr uint64_t kMinMemory = 128 << 20; // libraries alone take half of it
    app.add_option("--sandbox", options.resources.roots,
                   "folder or file that scenes may read, and no others; may be repeated")
        ->allow_extra_args(false);
    app.add_option("--max-memory", options.resources.maxMemory, "memory limit, e.g. 4G or 800M")
        ->transform(byteSize(kMinMemory));
    app.add_flag("--strict", options.strict, "exit with code 6 if a sample is NaN, infinite or too large");
    app.add_option("--clamp", options.clamp, "scale down samples with a channel above this; biases the image")
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
