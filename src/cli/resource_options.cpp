#include "cli/resource_options.h"

#include "cli/option_validators.h"

#include <sys/resource.h>

namespace strobe {

void addGuardOptions(CLI::App& app, Options& options) {
    constexpr uint64_t kLeast = 128 << 20; // libraries alone take half of it
    app.add_option("--sandbox", options.guard.roots,
                   "a folder (or file): scenes may read nothing else; may be given again")
        ->allow_extra_args(false);
    app.add_option("--max-memory", options.guard.maxMemory, "most memory to take, e.g. 4G or 800M")
        ->transform(byteSize(kLeast));
    app.add_flag("--strict", options.strict, "fail (exit code 6) if a sample is NaN, infinite or too large");
    app.add_option("--clamp", options.clamp,
                   "darken samples of which a channel is more than this; biases the picture")
        ->transform(numberAboveZero<float>());
}

void limitMemory(const ResourcePolicy::Settings& guard) {
    if (guard.maxMemory == 0)
        return;
    rlimit limit{};
    if (getrlimit(RLIMIT_DATA, &limit) == 0 && limit.rlim_cur > guard.maxMemory) {
        limit.rlim_cur = guard.maxMemory;
        setrlimit(RLIMIT_DATA, &limit);
    }
}

} // namespace strobe
