#include "samplers/aliases.h"

namespace strobe {

std::map<std::string, std::string> samplerAliases() {
    std::map<std::string, std::string> names{{"random", "independent"}};
    for (const char* name : {"lowdiscrepancy", "halton", "02sequence", "zerotwosequence", "zsobol",
                             "paddedsobol", "pmj02bn", "bestcandidate", "adaptive"})
        names[name] = "sobol";
    return names;
}

} // namespace strobe
