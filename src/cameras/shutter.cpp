#include "cameras/shutter.h"

namespace strobe {

Shutter readShutter(const ParamSet& params) {
    const Shutter shutter{params.get(kShutterOpen), params.get(kShutterClose)};
    for (const ParamDef<float>* def : {&kShutterOpen, &kShutterClose})
        if (!std::isfinite(params.get(*def)))
            throw Error(params.whereIs(*def), std::string("\"") + def->name + "\" must be finite");
    if (shutter.close < shutter.open)
        throw Error(params.whereIs(params.has(kShutterClose) ? kShutterClose : kShutterOpen),
                    "the shutter closes before it opens");
    return shutter;
}

} // namespace strobe
